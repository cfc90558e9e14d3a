#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "sovo/app/report/dive.h"

namespace sovo::app {

/// What happened in a bin of time.
struct DiveRate {
  double time_s = 0.0;  ///< Middle of the bin, since the recording began.
  double frames = 0.0;  ///< A second.
  std::uint64_t losses = 0;
};

/// Times of a stage [ms].
struct DiveStage {
  std::string name;
  std::size_t runs = 0;
  double median_ms = 0.0, p95_ms = 0.0, max_ms = 0.0;
};

/// The numbers of a dive. Counters count from the first status of the recording on, and go on over
/// a restart of the odometry, which sets them to zero.
struct DiveSummary {
  std::size_t frames = 0;        ///< That the odometry reported on.
  std::size_t sent = 0;          ///< By the camera, from the first to the last of `frames`.
  std::size_t metric_poses = 0;  ///< Published with a known scale.
  std::uint64_t lost_transport = 0, dropped_queue = 0, rejected = 0;
  std::size_t segments = 0;
  double distance_m = 0.0;  ///< Along the metric poses.
  double rate_hz = 0.0;     ///< Median.
  double latency_median_s = 0.0, latency_p95_s = 0.0, latency_max_s = 0.0;
  std::size_t keyframes = 0;
  double last_sigma = 0.0;  ///< Of the log-scale, at the last metric pose.
  std::vector<DiveRate> rates;
  std::vector<DiveStage> stages;
};

DiveSummary summarize(const Dive& dive);

}  // namespace sovo::app
