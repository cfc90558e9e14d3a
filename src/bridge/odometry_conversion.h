#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "message_traits.h"
#include "sovo/odometry/odometry_output.h"

namespace sovo::bridge {

/// Frame names of what is published.
struct OdometryFrames {
  std::string odom = "odom";
  std::string base_link = "base_link";
};

/// Motion of the base frame, made from that of the left camera.
struct BaseMotion {
  SE3 T_odom_base;       ///< odom: REP-103 axes, the base frame at the start of the segment.
  Mat6 pose_covariance;  ///< Of (translation, rotation about fixed odom axes).
  Vec6 twist;            ///< (linear, angular) of the base in its own axes [m/s, rad/s].
  Mat6 twist_covariance;
};

/// The odometry's world has the axes of the first left camera; `odom` has those of the first base:
/// T_odom_base = A T_world_left A^-1 with A = T_base_left. Covariances follow to first order.
BaseMotion to_base(const OdometryOutput& output, const SE3& T_base_left);

/// How long one stage takes.
struct StageTime {
  Stage stage = Stage::kFrame;
  float last_ms = 0.0F;
  float mean_ms = 0.0F;
  float max_ms = 0.0F;
};

/// What loop closing has done.
struct LoopStatus {
  std::uint64_t places = 0, closed = 0;
  std::uint64_t dropped = 0;  ///< Keyframes that it had no time for.
};

/// What VoStatus says beside the odometry's own state: known to the process around it.
struct FeedStatus {
  std::uint64_t lost_transport = 0;  ///< Missing in the received sequence.
  std::uint64_t dropped_queue = 0;   ///< Given up before the odometry saw them.
  std::uint64_t rejected = 0;        ///< Malformed, or of a second publisher.
  std::uint64_t last_command_id = 0;
  std::string last_command_result;
  std::string camera_frame;  ///< Left optical frame, as the frames name it.
  /// Time that latency is counted from [ns, UTC]; 0: the frame's stamp.
  std::int64_t latency_origin_ns = 0;
  std::optional<LoopStatus> loops;  ///< Where loops are closed; on /diagnostics.
};

// All messages below borrow from their arguments (borrow.h).

msg::Odometry to_odometry(const OdometryOutput& output, const BaseMotion& motion,
                          const OdometryFrames& frames);

msg::ScaledOdometry to_scaled_odometry(const OdometryOutput& output, const BaseMotion& motion,
                                       const OdometryFrames& frames);

/// `keyframe` in the axes of odom: T_odom_left = A T_world_left, A = T_base_left.
msg::Keyframe to_message(const KeyframeOutput& keyframe, const SE3& T_base_left,
                         const OdometryFrames& frames);

/// Position of the base frame at a keyframe.
msg::PoseStamped to_path_pose(const KeyframeOutput& keyframe, const SE3& T_base_left,
                              const OdometryFrames& frames);

/// A VoStatus message with the texts that it borrows.
class StatusMessage {
 public:
  /// `now_ns`: time of publication [ns, UTC].
  StatusMessage(const OdometryOutput& output, const FeedStatus& feed,
                const std::vector<StageTime>& stages, const OdometryFrames& frames,
                std::int64_t now_ns);
  StatusMessage(const StatusMessage&) = delete;
  StatusMessage& operator=(const StatusMessage&) = delete;

  const msg::VoStatus& message() const { return message_; }

 private:
  std::vector<std::string> stage_names_;
  std::vector<msg::StageTiming> stages_;
  msg::VoStatus message_{};
};

}  // namespace sovo::bridge
