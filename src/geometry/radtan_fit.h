#pragma once

#include <optional>

#include "sovo/geometry/camera_model.h"
#include "sovo/geometry/stereo_rig.h"

namespace sovo {

/// A camera as programs know it that have no flat ports.
struct RadtanFit {
  CameraModel camera;     ///< With radtan distortion of eight coefficients, and without a port.
  double worst_px = 0.0;  ///< How far from where it belongs it puts a direction, at most.
};

/// The camera that sees directions most nearly as `camera` does, whose rays it takes to meet in the
/// origin. Nothing where `camera` sees hardly anything.
std::optional<RadtanFit> fit_radtan(const CameraModel& camera);

/// The rig for those programs. A camera without a port stays as it is; one that sees hardly
/// anything through its port has a focal length of 0, as ROS writes what is not calibrated.
StereoRig without_ports(const StereoRig& rig);

}  // namespace sovo
