#include "sovo/app/run_recorder.h"

#include <spdlog/spdlog.h>

namespace sovo::app {

void RunRecorder::on_frame(const OdometryOutput& output) {
  const std::lock_guard lock(mutex_);
  if (counts_.fed == 0) first_segment_ = output.segment;
  ++counts_.fed;
  counts_.tracked += output.pose_valid ? 1 : 0;
  counts_.new_segments = output.segment - first_segment_;
  counts_.rejected = output.rejected;
  counts_.dropped = output.dropped_queue;
  counts_.corner_light = output.corner_light;
  counts_.state = to_string(output.state);
  ++counts_.states[counts_.state];
  if (output.pose_valid) counts_.focal_error = output.focal_error;
  if (output.pose_valid && keep_.live_poses) {
    live_.push_back({output.stamp_ns, output.T_odom_left});
  }
  if (output.reason != last_reason_) {
    spdlog::info("frame {}: {}{}{}", output.sequence, counts_.state,
                 output.reason.empty() ? "" : ": ", output.reason);
  }
  last_reason_ = output.reason;
}

void RunRecorder::on_keyframe(const KeyframeOutput& keyframe) {
  const std::lock_guard lock(mutex_);
  counts_.keyframes += keyframe.revised ? 0 : 1;
}

void RunRecorder::on_scale(const ScaleRecord& record) {
  const std::lock_guard lock(mutex_);
  ++counts_.verdicts[to_string(record.verdict)];
  if (keep_.scale_records) scales_.push_back(record);
}

void RunRecorder::clear() {
  const std::lock_guard lock(mutex_);
  counts_ = {};
  last_reason_.clear();
  live_.clear();
  scales_.clear();
}

RunCounts RunRecorder::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

std::vector<TrajectoryPose> RunRecorder::live_poses() const {
  const std::lock_guard lock(mutex_);
  return live_;
}

std::vector<ScaleRecord> RunRecorder::scale_records() const {
  const std::lock_guard lock(mutex_);
  return scales_;
}

}  // namespace sovo::app
