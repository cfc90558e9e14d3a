#pragma once

#include <cstdint>

#include "sovo/geometry/se3.h"
#include "sovo/odometry/odometry_output.h"

namespace sovo {

/// What was published of the frame before, in the same segment.
struct PublishedPose {
  std::int64_t stamp_ns = 0;
  SE3 T_odom_left;
  Mat6 frame_covariance = Mat6::Zero();
};

/// Sets velocity and its covariance from the frame before to this one: both alignments err, and the
/// scale does. Returns the way between them [m].
double set_velocity(const PublishedPose& before, double log_scale_sigma, OdometryOutput* out);

}  // namespace sovo
