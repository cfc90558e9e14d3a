#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "sovo/odometry/odometry_output.h"

namespace sovo::app {

/// What a run amounted to so far.
struct RunCounts {
  std::uint64_t fed = 0;                          ///< Frames given to the odometry.
  std::uint64_t tracked = 0;                      ///< Of them, with a valid pose.
  std::uint64_t keyframes = 0;                    ///< Distinct ones given out.
  std::uint64_t new_segments = 0;                 ///< After the first.
  std::uint64_t rejected = 0;                     ///< Frames refused.
  std::uint64_t dropped = 0;                      ///< Frames that mapping had no time for.
  std::uint32_t queue_depth = 0;                  ///< Frames that wait for mapping.
  std::map<std::string, std::uint64_t> states;    ///< Frames by the state they were given.
  std::map<std::string, std::uint64_t> verdicts;  ///< Scale optimizations by verdict.
  double corner_light = 1.0;                      ///< Of the newest frame.
  std::string state;                              ///< And its state.
  double focal_error = 0.0;                       ///< Of the newest frame with a pose.
  /// Completion: frames with a valid pose / frames fed.
  double completion() const {
    return fed == 0 ? 0.0 : static_cast<double>(tracked) / static_cast<double>(fed);
  }
};

/// Keeps what the end of a run has to tell. Histories are kept only where asked for: a run may
/// last for days.
class RunRecorder : public OutputSink {
 public:
  struct Keep {
    bool live_poses = false;
    bool scale_records = false;
  };
  explicit RunRecorder(Keep keep) : keep_(keep) {}

  void on_frame(const OdometryOutput& output) override;
  void on_keyframe(const KeyframeOutput& keyframe) override;
  void on_scale(const ScaleRecord& record) override;

  /// Forgets everything.
  void clear();

  RunCounts counts() const;
  std::vector<TrajectoryPose> live_poses() const;
  std::vector<ScaleRecord> scale_records() const;

 private:
  const Keep keep_;
  mutable std::mutex mutex_;
  RunCounts counts_;
  std::uint32_t first_segment_ = 0;
  std::string last_reason_;
  std::vector<TrajectoryPose> live_;
  std::vector<ScaleRecord> scales_;
};

}  // namespace sovo::app
