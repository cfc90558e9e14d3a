#include "sovo/odometry/frame_velocity.h"

#include "sovo/geometry/pose_covariance.h"

namespace sovo {

double set_velocity(const PublishedPose& before, double log_scale_sigma, OdometryOutput* out) {
  const double dt = 1e-9 * static_cast<double>(out->stamp_ns - before.stamp_ns);
  const SE3 step = before.T_odom_left.inverse() * out->T_odom_left;
  out->velocity = step.log() / dt;
  const SO3 R_left_odom = out->T_odom_left.rotation().inverse();
  out->velocity_covariance =
      rotated(R_left_odom, before.frame_covariance + out->frame_covariance) / (dt * dt);
  const Vec3 error = log_scale_sigma * out->velocity.head<3>();
  out->velocity_covariance.topLeftCorner<3, 3>() += error * error.transpose();
  return step.translation().norm();
}

}  // namespace sovo
