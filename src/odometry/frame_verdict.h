#pragma once

#include <string>

#include "sovo/odometry/odometry_output.h"
#include "sovo/odometry/stereo_odometry.h"
#include "sovo/vo/monocular_backend.h"

namespace sovo {

/// Sets state and reason of a frame that has a pose, from what else `out` has. `tracking`: how it
/// was found; not `good` for the one that a map begins with. `mean_rho`: of the map [1/m].
/// `right_problem`: what is wrong with the right image; empty: nothing.
void judge_frame(const StereoOdometryConfig& config, const FrameTracking& tracking, double mean_rho,
                 const std::string& right_problem, OdometryOutput* out);

}  // namespace sovo
