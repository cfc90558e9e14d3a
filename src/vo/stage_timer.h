#pragma once

#include <chrono>

#include "sovo/vo/monocular_backend.h"

namespace sovo {

/// Tells a timer how long it lived.
class StageTimer {
 public:
  StageTimer(const MapTimer& timer, MapStage stage)
      : timer_(timer), stage_(stage), start_(std::chrono::steady_clock::now()) {}
  ~StageTimer() {
    if (!timer_) return;
    const std::chrono::duration<double> d = std::chrono::steady_clock::now() - start_;
    timer_(stage_, d.count());
  }
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

 private:
  const MapTimer& timer_;
  MapStage stage_;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace sovo
