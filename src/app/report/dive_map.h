#pragma once

#include <vector>

#include "sovo/app/report/dive.h"

namespace sovo::app {

/// Points that the keyframes saw, in `odom` [m]; those that are sure enough, thinned to at most
/// `most`. Empty without a recorded calibration. `config`: the odometry's; its undistortion and
/// size make the pixels that keyframes are written in.
std::vector<Vec3> map_points(const Dive& dive, const StereoOdometryConfig& config,
                             std::size_t most);

}  // namespace sovo::app
