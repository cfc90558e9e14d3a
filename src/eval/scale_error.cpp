#include "sovo/eval/scale_error.h"

#include <cmath>

#include "sovo/eval/kitti_metric.h"
#include "sovo/eval/statistics.h"

namespace sovo {
namespace {

double displacement(std::span<const SE3> poses, int first, int last) {
  return (poses[last].translation() - poses[first].translation()).norm();
}

/// Slope of ln s over distance by least squares [1/m]; 0 where it is undetermined.
double slope_of(std::span<const ScaleSample> samples) {
  double mean_x = 0.0;
  double mean_y = 0.0;
  const double n = static_cast<double>(samples.size());
  for (const ScaleSample& s : samples) {
    mean_x += s.distance / n;
    mean_y += s.log_scale / n;
  }
  double xx = 0.0;
  double xy = 0.0;
  for (const ScaleSample& s : samples) {
    xx += (s.distance - mean_x) * (s.distance - mean_x);
    xy += (s.distance - mean_x) * (s.log_scale - mean_y);
  }
  return xx > 0.0 ? xy / xx : 0.0;
}

}  // namespace

std::vector<ScaleSample> scale_errors(std::span<const SE3> truth, std::span<const SE3> estimate,
                                      std::span<const int> starts, double length) {
  const std::vector<double> distances = travelled_distances(truth);
  std::vector<ScaleSample> samples;
  for (std::size_t i = 0; i < starts.size(); ++i) {
    for (std::size_t j = i + 1; j < starts.size(); ++j) {
      const double moved = displacement(truth, starts[i], starts[j]);
      if (moved < length) continue;
      const double estimated = displacement(estimate, starts[i], starts[j]);
      if (estimated > 0.0) {
        samples.push_back(
            {starts[i], starts[j], distances[starts[i]], std::log(moved / estimated)});
      }
      break;
    }
  }
  return samples;
}

ScaleErrorSummary summarize(std::span<const ScaleSample> samples) {
  ScaleErrorSummary out;
  out.count = static_cast<int>(samples.size());
  std::vector<double> signed_errors;
  std::vector<double> magnitudes;
  for (const ScaleSample& s : samples) {
    signed_errors.push_back(s.log_scale);
    magnitudes.push_back(std::abs(s.log_scale));
  }
  out.median_abs = quantile(magnitudes, 0.5);
  out.p95_abs = quantile(magnitudes, 0.95);
  out.bias = quantile(signed_errors, 0.5);
  out.drift_per_100m = 100.0 * slope_of(samples);
  return out;
}

}  // namespace sovo
