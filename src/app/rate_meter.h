#pragma once

#include <chrono>
#include <cstddef>
#include <deque>
#include <optional>

namespace sovo::app {

/// How often messages come and how large they are, over the last ten seconds.
class RateMeter {
 public:
  using Clock = std::chrono::steady_clock;

  struct Rate {
    std::size_t messages = 0;  ///< In the window.
    double hertz = 0.0;
    double shortest_s = 0.0, longest_s = 0.0, deviation_s = 0.0;  ///< Of the intervals.
    double bytes_per_s = 0.0;
    std::size_t smallest = 0, largest = 0;  ///< Bytes of a message.
    double mean_bytes = 0.0;
  };

  void add(Clock::time_point now, std::size_t bytes);

  /// Nothing when there are less than two messages in the window.
  std::optional<Rate> rate(Clock::time_point now);

 private:
  struct Message {
    Clock::time_point arrived;
    std::size_t bytes;
  };
  std::deque<Message> messages_;
};

}  // namespace sovo::app
