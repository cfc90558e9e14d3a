#pragma once

#include <vector>

#include "sovo/driver/sim/ray_batch.h"
#include "sovo/driver/sim/sim_config.h"
#include "sovo/geometry/stereo_rig.h"

namespace sovo::sim {

/// What a small rover keeps from the sun's light: a shadow that moves with the cameras. The rover
/// is a body behind and below them, a mast, and the cameras' housing, each what is within a radius
/// of a line.
class OwnShadow {
 public:
  /// No vehicle: nothing is in the shade.
  OwnShadow() = default;
  /// The rover that carries `rig`, as `side` has it.
  OwnShadow(const StereoRig& rig, Side side);

  bool falls() const { return !bars_.empty(); }

  /// Share of the sun's disc that the vehicle hides from `point`, 0 to 1. `to_sun`: unit vector;
  /// both in the camera's frame.
  float hidden(const Eigen::Vector3f& point, const Eigen::Vector3f& to_sun) const;

 private:
  /// What is within `radius` of the line from `a` to `b`, in the camera's frame [m].
  struct Bar {
    Eigen::Vector3f a, b;
    float radius;
  };

  std::vector<Bar> bars_;
};

}  // namespace sovo::sim
