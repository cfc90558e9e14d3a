#pragma once

#include <array>
#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "sovo/odometry/odometry_output.h"

namespace sovo::app {

/// Times of one stage.
struct StageSummary {
  std::string name;
  std::uint64_t count = 0;
  double last_ms = 0.0;
  double mean_ms = 0.0;
  double median_ms = 0.0;
  double p95_ms = 0.0;
  double max_ms = 0.0;
};

/// Sizes of the work beside its times.
struct WorkCounters {
  double points = 0.0;     ///< Active in the window, mean over the bundle adjustments.
  double residuals = 0.0;  ///< Mean over the bundle adjustments.
  std::uint64_t windows = 0;
};

/// Times of one stage in bounded memory: count, mean and extremes of all, quantiles of all as long
/// as they are few and of every 2^n-th later.
class DurationSamples {
 public:
  void add(double seconds);
  std::uint64_t count() const { return count_; }
  double last() const { return last_; }
  double mean() const { return count_ == 0 ? 0.0 : sum_ / static_cast<double>(count_); }
  double max() const { return max_; }
  /// Quantile q in [0, 1] [s]; 0 when there is nothing.
  double quantile(double q) const;

 private:
  static constexpr std::size_t kCapacity = 16384;
  std::vector<float> kept_;
  std::uint64_t stride_ = 1;
  std::uint64_t count_ = 0;
  double sum_ = 0.0, last_ = 0.0, max_ = 0.0;
};

/// Collects the times of all stages of a run.
class ProfileCollector : public StageObserver {
 public:
  void on_stage(Stage stage, double seconds) override;
  void on_window(std::uint32_t points, std::uint32_t residuals) override;

  /// One a stage, in the order of `Stage`, also those that never ran.
  std::vector<StageSummary> stages() const;
  WorkCounters counters() const;

 private:
  mutable std::mutex mutex_;
  std::array<DurationSamples, static_cast<std::size_t>(Stage::kCount)> samples_;
  double points_sum_ = 0.0, residuals_sum_ = 0.0;
  std::uint64_t windows_ = 0;
};

}  // namespace sovo::app
