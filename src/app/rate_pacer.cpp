#include "sovo/app/rate_pacer.h"

#include <algorithm>
#include <thread>

#include "sovo/io/text.h"

namespace sovo::app {

Result<PlayRate> parse_rate(const std::string& text) {
  if (text == "max") return PlayRate{};
  const auto factor = parse_double(text);
  if (!factor || *factor <= 0.0) {
    return Error{"camera.rate is \"" + text +
                 "\"; give a positive number (1.0 is real time) or max"};
  }
  return PlayRate{*factor};
}

bool RatePacer::wait_for(std::int64_t stamp_ns, const std::function<bool()>& stop) {
  if (rate_.unlimited()) return !stop();
  if (!start_) {
    start_ = Clock::now();
    first_stamp_ns_ = stamp_ns;
  }
  const std::chrono::duration<double, std::nano> offset(
      static_cast<double>(stamp_ns - first_stamp_ns_) / *rate_.factor);
  const auto due = *start_ + std::chrono::duration_cast<Clock::duration>(offset);
  constexpr std::chrono::milliseconds kSlice(50);
  while (Clock::now() < due) {
    if (stop()) return false;
    std::this_thread::sleep_until(std::min(due, Clock::now() + kSlice));
  }
  return !stop();
}

}  // namespace sovo::app
