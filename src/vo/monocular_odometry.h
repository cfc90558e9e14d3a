#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "sovo/geometry/camera_model.h"
#include "sovo/geometry/se3.h"
#include "sovo/image/pyramid.h"

namespace sovo {

/// Points of a sliding window as the newest keyframe sees them, one array a quantity.
struct KeyframePoints {
  std::vector<float> u, v;           ///< Sub-pixel position in the keyframe's level 0 [px].
  std::vector<float> inverse_depth;  ///< 1 / z in the keyframe's camera frame [1/m].
  std::vector<float> sigma;          ///< Standard deviation of inverse_depth [1/m].
  std::size_t size() const { return u.size(); }
  void reserve(std::size_t n) {
    for (auto* values : {&u, &v, &inverse_depth, &sigma}) values->reserve(n);
  }
};

/// What a monocular odometry hands out about its newest keyframe: all that scale optimization
/// needs of it.
struct KeyframeSnapshot {
  std::uint32_t id = 0;
  std::int64_t stamp_ns = 0;
  std::uint64_t scale_epoch = 0;  ///< Similarities applied to the window before this snapshot.
  double log_scale = 0.0;         ///< Sum of the log-scales of those similarities.
  SE3 T_world_camera;
  CameraModel camera;       ///< Undistorted left camera (no distortion) of `pyramid`'s level 0.
  ImagePyramidPtr pyramid;  ///< Undistorted left image, photometrically corrected.
  KeyframePoints points;
  double shared_points = 0.0;       ///< Share of the points that the last snapshot had too.
  double mean_inverse_depth = 1.0;  ///< Of the window's points [1/m].
};

/// A similarity measured on a snapshot: every length of the window is to be multiplied by
/// exp(log_scale) (inverse depths divided), the newest keyframe's camera centre staying where it
/// is.
struct ScaleCorrection {
  std::uint32_t keyframe_id = 0;
  std::uint64_t scale_epoch = 0;
  double log_scale = 0.0;
  /// The map had no scale so far: what was built in it before is rescaled for good, too.
  bool first_lock = false;
};

}  // namespace sovo
