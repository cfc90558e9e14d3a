#include "sovo/bridge/odometry_conversion.h"

#include <limits>

#include "sovo/bridge/borrow.h"
#include "sovo/bridge/ros_conversion.h"

namespace sovo::bridge {
namespace {

msg::Header header_of(std::int64_t stamp, const std::string& frame) {
  return {to_message(stamp), borrow(frame)};
}

msg::PoseWithCovariance pose_of(const BaseMotion& motion) {
  msg::PoseWithCovariance m{};
  m.pose = to_pose(motion.T_odom_base);
  to_message(motion.pose_covariance, m.covariance);
  return m;
}

msg::TwistWithCovariance twist_of(const BaseMotion& motion) {
  msg::TwistWithCovariance m{};
  const Vec6& v = motion.twist;
  m.twist = {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
  to_message(motion.twist_covariance, m.covariance);
  return m;
}

double latency_s(const OdometryOutput& output, const FeedStatus& feed, std::int64_t now_ns) {
  const std::int64_t origin =
      feed.latency_origin_ns != 0 ? feed.latency_origin_ns : output.stamp_ns;
  return 1e-9 * static_cast<double>(now_ns - origin);
}

}  // namespace

BaseMotion to_base(const OdometryOutput& output, const SE3& T_base_left) {
  const SE3& A = T_base_left;
  BaseMotion motion;
  motion.T_odom_base = A * output.T_odom_left * A.inverse();
  // With the perturbation (tau, theta) in world axes, R' = A_R exp(theta) R A_R^T and
  // t' = A_R (t + tau) + a - R' a, hence d(t', rotation') / d(tau, theta) =
  //   [ A_R   hat(R' a) A_R ]
  //   [  0         A_R      ]
  const Mat3 A_R = A.rotation_matrix();
  Mat6 J = Mat6::Zero();
  J.topLeftCorner<3, 3>() = A_R;
  J.bottomRightCorner<3, 3>() = A_R;
  J.topRightCorner<3, 3>() = hat(motion.T_odom_base.rotation() * A.translation()) * A_R;
  motion.pose_covariance = J * output.pose_covariance * J.transpose();
  // A twist in the axes of its own body moves to another point of the body by the adjoint.
  const Mat6 adjoint = A.adjoint();
  motion.twist = adjoint * output.velocity;
  motion.twist_covariance = adjoint * output.velocity_covariance * adjoint.transpose();
  return motion;
}

msg::Odometry to_odometry(const OdometryOutput& output, const BaseMotion& motion,
                          const OdometryFrames& frames) {
  msg::Odometry m{};
  m.header = header_of(output.stamp_ns, frames.odom);
  m.child_frame_id = borrow(frames.base_link);
  m.pose = pose_of(motion);
  m.twist = twist_of(motion);
  return m;
}

msg::ScaledOdometry to_scaled_odometry(const OdometryOutput& output, const BaseMotion& motion,
                                       const OdometryFrames& frames) {
  msg::ScaledOdometry m{};
  m.header = header_of(output.stamp_ns, frames.odom);
  m.child_frame_id = borrow(frames.base_link);
  m.session = output.session;
  m.sequence = output.sequence;
  m.pose = pose_of(motion);
  m.twist = twist_of(motion);
  m.state = static_cast<std::uint8_t>(output.state);
  m.segment = output.segment;
  m.keyframe_id = output.keyframe_id;
  m.is_keyframe = output.is_keyframe;
  m.scale_valid = output.scale_valid;
  m.log_scale = output.log_scale;
  m.log_scale_sigma = output.log_scale_sigma;
  m.last_correction = output.last_correction;
  m.scale_residual = output.scale_residual;
  m.scale_age_s = output.scale_age_s;
  m.scale_verdict = static_cast<std::uint8_t>(output.scale_verdict);
  return m;
}

msg::Keyframe to_message(const KeyframeOutput& keyframe, const SE3& T_base_left,
                         const OdometryFrames& frames) {
  msg::Keyframe m{};
  m.header = header_of(keyframe.stamp_ns, frames.odom);
  m.id = keyframe.id;
  m.segment = keyframe.segment;
  m.pose = to_pose(T_base_left * keyframe.T_odom_left);
  m.log_scale =
      keyframe.scale_valid ? keyframe.log_scale : std::numeric_limits<double>::quiet_NaN();
  borrow(m.u, keyframe.u);
  borrow(m.v, keyframe.v);
  borrow(m.inverse_depth, keyframe.inverse_depth);
  borrow(m.sigma, keyframe.sigma);
  borrow(m.intensity, keyframe.intensity);
  return m;
}

msg::PoseStamped to_path_pose(const KeyframeOutput& keyframe, const SE3& T_base_left,
                              const OdometryFrames& frames) {
  return {header_of(keyframe.stamp_ns, frames.odom),
          to_pose(T_base_left * keyframe.T_odom_left * T_base_left.inverse())};
}

StatusMessage::StatusMessage(const OdometryOutput& output, const FeedStatus& feed,
                             const std::vector<StageTime>& stages, const OdometryFrames& frames,
                             std::int64_t now_ns) {
  msg::VoStatus& m = message_;
  m.header = header_of(output.stamp_ns, frames.odom);
  m.state = static_cast<std::uint8_t>(output.state);
  m.reason = borrow(output.reason);
  m.session = output.session;
  m.sequence = output.sequence;
  m.received = output.received;
  m.lost_transport = feed.lost_transport;
  m.dropped_queue = output.dropped_queue + feed.dropped_queue;
  m.rejected = output.rejected + feed.rejected;
  m.last_command_id = feed.last_command_id;
  m.last_command_result = borrow(feed.last_command_result);
  m.reset_counter = output.reset_counter;
  m.segment = output.segment;
  m.points = output.points;
  m.inliers = output.inliers;
  m.keyframes = output.keyframes;
  m.queue_depth = output.queue_depth;
  m.sync_error_s = output.sync_error_s;
  m.residual = output.residual;
  m.latency_s = latency_s(output, feed, now_ns);
  m.distance_m = output.distance_m;
  stage_names_.reserve(stages.size());
  for (const StageTime& stage : stages) {
    stage_names_.push_back(to_string(stage.stage));
    stages_.push_back({borrow(stage_names_.back()), stage.last_ms, stage.mean_ms, stage.max_ms});
  }
  borrow(m.stages, stages_);
}

}  // namespace sovo::bridge
