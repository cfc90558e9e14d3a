#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "sovo/bridge/background_worker.h"
#include "sovo/bridge/odometry_conversion.h"
#include "sovo/bridge/participant.h"
#include "sovo/bridge/writer.h"

namespace sovo::bridge {

/// What an odometry process that closes loops publishes beside VoPublisher: `map -> odom` on `/tf`,
/// with the stamp of each frame that has a metric pose, and `map_path`, the places in frame `map`,
/// when a loop was closed, else at 1 Hz.
///
/// Of `odom` nothing changes; frame `map` jumps when a loop is closed (REP-105).
class MapPublisher : public OutputSink {
 public:
  ~MapPublisher() override;

  /// `publish_tf`: false where another process sends the transforms.
  static Result<std::unique_ptr<MapPublisher>> open(const Participant& participant, bool publish_tf,
                                                    const SE3& T_base_left);

  /// `T_map_odom`: where the odometry's world lies in the corrected one, both with the left
  /// camera's first pose as origin; `places`: T_map_left of the places. `closed`: a loop was. From
  /// any thread.
  void set_map(const SE3& T_map_odom, const std::vector<TrajectoryPose>& places, bool closed);

  void on_frame(const OdometryOutput& output) override;
  void on_keyframe(const KeyframeOutput& /*keyframe*/) override {}
  void on_scale(const ScaleRecord& /*record*/) override {}

  /// Writes that failed since the start, and what was wrong with the last.
  std::uint64_t failed_writes() const { return failed_writes_; }
  std::string last_failure() const;

 private:
  struct Writers;

  MapPublisher();
  void check(const Result<void>& written);

  SE3 T_base_left_;
  std::string map_frame_, odom_frame_;
  std::unique_ptr<Writers> writers_;

  mutable std::mutex mutex_;  // of what follows
  SE3 T_map_odom_;
  Pace path_pace_{std::chrono::seconds(1)};
  std::string failure_;

  std::atomic<std::uint64_t> failed_writes_{0};
};

}  // namespace sovo::bridge
