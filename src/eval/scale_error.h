#pragma once

#include <span>
#include <vector>

#include "sovo/geometry/se3.h"

namespace sovo {

/// Error of the scale over a piece of trajectory.
struct ScaleSample {
  int first = 0;           ///< Index of the piece's first pose.
  int last = 0;            ///< Index of its last pose.
  double distance = 0.0;   ///< Travelled along the truth up to the first pose [m].
  double log_scale = 0.0;  ///< ln(true displacement / estimated displacement).
};

struct ScaleErrorSummary {
  int count = 0;
  double median_abs = 0.0;      ///< Median of |ln s|.
  double p95_abs = 0.0;         ///< 95th percentile of |ln s|.
  double bias = 0.0;            ///< Median of ln s: positive when the estimate is too small.
  double drift_per_100m = 0.0;  ///< Slope of ln s over distance travelled [1/100 m].
};

/// Compares displacements: from each pose of `starts` (indices, ascending) to the first later one
/// of `starts` that the truth moved by at least `length` [m] in a straight line. Starts without
/// such a pose give no sample.
std::vector<ScaleSample> scale_errors(std::span<const SE3> truth, std::span<const SE3> estimate,
                                      std::span<const int> starts, double length);

ScaleErrorSummary summarize(std::span<const ScaleSample> samples);

}  // namespace sovo
