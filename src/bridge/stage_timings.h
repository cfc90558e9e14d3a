#pragma once

#include <array>
#include <mutex>
#include <vector>

#include "sovo/bridge/odometry_conversion.h"

namespace sovo::bridge {

/// Keeps last, mean and largest time of every stage for VoStatus.
class StageTimings : public StageObserver {
 public:
  void on_stage(Stage stage, double seconds) override {
    const std::lock_guard lock(mutex_);
    Entry& entry = entries_.at(static_cast<std::size_t>(stage));
    entry.last_s = seconds;
    entry.sum_s += seconds;
    entry.max_s = std::max(entry.max_s, seconds);
    ++entry.count;
  }
  void on_window(std::uint32_t /*points*/, std::uint32_t /*residuals*/) override {}

  /// Stages that have run, in the order of `Stage`.
  std::vector<StageTime> times() const {
    const std::lock_guard lock(mutex_);
    std::vector<StageTime> result;
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      const Entry& entry = entries_[i];
      if (entry.count == 0) continue;
      const double mean_s = entry.sum_s / static_cast<double>(entry.count);
      result.push_back({static_cast<Stage>(i), static_cast<float>(1e3 * entry.last_s),
                        static_cast<float>(1e3 * mean_s), static_cast<float>(1e3 * entry.max_s)});
    }
    return result;
  }

 private:
  struct Entry {
    double last_s = 0.0;
    double sum_s = 0.0;
    double max_s = 0.0;
    std::uint64_t count = 0;
  };
  mutable std::mutex mutex_;
  std::array<Entry, static_cast<std::size_t>(Stage::kCount)> entries_{};
};

}  // namespace sovo::bridge
