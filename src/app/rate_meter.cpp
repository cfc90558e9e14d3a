#include "sovo/app/rate_meter.h"

#include <algorithm>
#include <cmath>

namespace sovo::app {

void RateMeter::add(Clock::time_point now, std::size_t bytes) { messages_.push_back({now, bytes}); }

std::optional<RateMeter::Rate> RateMeter::rate(Clock::time_point now) {
  constexpr std::chrono::seconds kWindow(10);
  while (!messages_.empty() && now - messages_.front().arrived > kWindow) messages_.pop_front();
  if (messages_.size() < 2) return std::nullopt;
  Rate rate;
  rate.messages = messages_.size();
  rate.smallest = rate.largest = messages_.front().bytes;
  rate.shortest_s = 1e9;
  double squares = 0.0;
  double bytes = static_cast<double>(messages_.front().bytes);
  const auto seconds = [](Clock::duration d) { return std::chrono::duration<double>(d).count(); };
  const double span = seconds(messages_.back().arrived - messages_.front().arrived);
  const auto intervals = static_cast<double>(messages_.size() - 1);
  const double mean = span / intervals;
  for (std::size_t i = 1; i < messages_.size(); ++i) {
    const double interval = seconds(messages_[i].arrived - messages_[i - 1].arrived);
    rate.shortest_s = std::min(rate.shortest_s, interval);
    rate.longest_s = std::max(rate.longest_s, interval);
    squares += (interval - mean) * (interval - mean);
    rate.smallest = std::min(rate.smallest, messages_[i].bytes);
    rate.largest = std::max(rate.largest, messages_[i].bytes);
    bytes += static_cast<double>(messages_[i].bytes);
  }
  rate.mean_bytes = bytes / (intervals + 1.0);
  rate.deviation_s = std::sqrt(squares / intervals);
  // All at once, as a latched topic's history comes, is no rate.
  if (span <= 0.0) return std::nullopt;
  rate.hertz = intervals / span;
  rate.bytes_per_s = rate.hertz * rate.mean_bytes;
  return rate;
}

}  // namespace sovo::app
