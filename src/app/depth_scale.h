#pragma once

#include <optional>

#include "sovo/driver/sim/sim_source.h"
#include "sovo/odometry/odometry_output.h"

namespace sovo::app {

/// What a keyframe's lengths are to be multiplied with to be true: the median of ln(true depth /
/// depth) over its points, whose places are those of the image of `tracked`, the undistorted left
/// camera. Nothing when fewer than thirty points lie on a surface.
std::optional<double> depth_log_scale(const KeyframeOutput& keyframe, const CameraModel& tracked,
                                      sim::SimSource* source);

}  // namespace sovo::app
