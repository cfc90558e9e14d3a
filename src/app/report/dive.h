#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sovo/geometry/camera_model.h"
#include "sovo/geometry/se3.h"
#include "sovo/io/result.h"
#include "sovo/odometry/stereo_odometry.h"

namespace sovo::app {

/// A pose as it was published.
struct DivePose {
  std::uint64_t log_ns = 0;   ///< When it was recorded.
  std::int64_t stamp_ns = 0;  ///< Of its frame.
  SE3 T_odom_base;
  double speed = 0.0;      ///< Of the base frame [m/s].
  std::uint8_t state = 0;  ///< As VoStatus.
  std::uint32_t run = 0;   ///< Of the odometry: each has an `odom` of its own.
  std::uint32_t segment = 0;
  std::uint32_t keyframe_id = 0;
  bool metric = false;     ///< Whether its scale was known.
  double log_scale = 0.0;  ///< Sum of corrections.
  double log_scale_sigma = 0.0;
  double scale_residual = 0.0;  ///< [grey levels]
  bool scale_accepted = false;  ///< Verdict on the last measurement.
};

/// Whether `now` is of another map than `before`: of another segment or run.
bool is_other_map(const DivePose& before, const DivePose& now);

/// Whether the way goes on from `before` to `now`: in one map, and within a second.
bool goes_on(const DivePose& before, const DivePose& now);

/// What the odometry said about a frame.
struct DiveStatus {
  std::uint64_t log_ns = 0;
  std::int64_t stamp_ns = 0;  ///< Of its frame.
  std::uint32_t run = 0;
  std::uint8_t state = 0;    ///< As VoStatus.
  std::uint32_t reason = 0;  ///< Index in `Dive::reasons`.
  std::uint64_t session = 0;
  std::uint64_t sequence = 0;
  std::uint32_t segment = 0;
  std::uint64_t received = 0, lost_transport = 0, dropped_queue = 0, rejected = 0;
  double latency_s = 0.0;
  double sync_error_s = 0.0;
  double distance_m = 0.0;  ///< In its segment.
};

/// A time that a process on /diagnostics was not well.
struct DiveComplaint {
  std::string name;
  std::uint8_t level = 0;  ///< The worst one: 1 warning, 2 error, 3 stale.
  std::string text;        ///< The last one of the worst level.
  std::uint64_t begin_ns = 0;
  std::uint64_t end_ns = 0;
};

/// A keyframe as it was written last.
struct DiveKeyframe {
  std::uint64_t log_ns = 0;   ///< When it was recorded first.
  std::int64_t stamp_ns = 0;  ///< Of its frame.
  std::uint32_t run = 0;
  SE3 T_odom_left;
  bool metric = false;
  std::vector<float> u, v, inverse_depth, sigma;
};

struct DiveTopic {
  std::string topic;
  std::string type;
  std::uint64_t messages = 0;
  std::string dropped;  ///< By the recorder; empty: none.
};

/// What a report needs of a recording; everything in it may come from anyone.
struct Dive {
  std::string path;
  std::string vehicle;  ///< Namespace, as "/sovo".
  std::uint64_t start_ns = 0;
  std::uint64_t end_ns = 0;
  std::vector<DivePose> poses;  ///< In the order of recording.
  std::vector<DiveStatus> statuses;
  std::vector<std::string> reasons;
  std::vector<DiveComplaint> complaints;  ///< Not those of the odometry, which `statuses` has.
  std::vector<DiveKeyframe> keyframes;
  std::map<std::string, std::vector<double>> stages;  ///< Times [ms] by name, each run once.
  std::optional<StereoCameras> cameras;
  std::vector<DiveTopic> topics;
  std::vector<std::string> notes;  ///< What was wrong with the recording.

  /// Seconds since the recording began.
  double seconds(std::uint64_t log_ns) const {
    return log_ns < start_ns ? 0.0 : static_cast<double>(log_ns - start_ns) * 1e-9;
  }
  double duration_s() const { return seconds(end_ns); }
};

/// Reads a recording: a file, or a folder of them. `ns`: the vehicle; empty: the only one. Errors:
/// nothing to read, no odometry in it, several vehicles or none of that name.
Result<Dive> read_dive(const std::string& path, const std::string& ns);

}  // namespace sovo::app
