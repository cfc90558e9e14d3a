#include "sovo/app/profile_collector.h"

#include <algorithm>
#include <cmath>

namespace sovo::app {

void DurationSamples::add(double seconds) {
  if (count_ % stride_ == 0) {
    if (kept_.size() == kCapacity) {  // keep every second one from here on
      for (std::size_t i = 0; i < kCapacity / 2; ++i) kept_[i] = kept_[2 * i];
      kept_.resize(kCapacity / 2);
      stride_ *= 2;
    }
    if (count_ % stride_ == 0) kept_.push_back(static_cast<float>(seconds));
  }
  ++count_;
  sum_ += seconds;
  last_ = seconds;
  max_ = std::max(max_, seconds);
}

double DurationSamples::quantile(double q) const {
  if (kept_.empty()) return 0.0;
  std::vector<float> sorted = kept_;
  const auto rank =
      static_cast<std::ptrdiff_t>(std::lround(q * static_cast<double>(sorted.size() - 1)));
  std::nth_element(sorted.begin(), sorted.begin() + rank, sorted.end());
  return static_cast<double>(sorted[static_cast<std::size_t>(rank)]);
}

void ProfileCollector::on_stage(Stage stage, double seconds) {
  const std::lock_guard lock(mutex_);
  samples_[static_cast<std::size_t>(stage)].add(seconds);
}

void ProfileCollector::on_window(std::uint32_t points, std::uint32_t residuals) {
  const std::lock_guard lock(mutex_);
  points_sum_ += points;
  residuals_sum_ += residuals;
  ++windows_;
}

std::vector<StageSummary> ProfileCollector::stages() const {
  const std::lock_guard lock(mutex_);
  std::vector<StageSummary> summaries;
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    const DurationSamples& s = samples_[i];
    summaries.push_back({to_string(static_cast<Stage>(i)), s.count(), 1e3 * s.last(),
                         1e3 * s.mean(), 1e3 * s.quantile(0.5), 1e3 * s.quantile(0.95),
                         1e3 * s.max()});
  }
  return summaries;
}

WorkCounters ProfileCollector::counters() const {
  const std::lock_guard lock(mutex_);
  if (windows_ == 0) return {};
  const auto n = static_cast<double>(windows_);
  return {points_sum_ / n, residuals_sum_ / n, windows_};
}

}  // namespace sovo::app
