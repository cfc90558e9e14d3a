#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "sovo/io/result.h"

namespace sovo::app {

/// How fast a recording is played.
struct PlayRate {
  /// Times real time; nothing: as fast as can be.
  std::optional<double> factor;
  bool unlimited() const { return !factor.has_value(); }
};

/// "max", or a positive number ("1.0").
Result<PlayRate> parse_rate(const std::string& text);

/// Holds frames back until their time has come, by a steady clock.
class RatePacer {
 public:
  explicit RatePacer(PlayRate rate) : rate_(rate) {}

  /// Waits until a frame of this stamp is due; the first one is at once. Asks `stop` now and then
  /// and returns false when it says so. A frame that is late is not waited for, and those after
  /// it keep their own times.
  bool wait_for(std::int64_t stamp_ns, const std::function<bool()>& stop);

 private:
  using Clock = std::chrono::steady_clock;
  PlayRate rate_;
  std::optional<Clock::time_point> start_;
  std::int64_t first_stamp_ns_ = 0;
};

}  // namespace sovo::app
