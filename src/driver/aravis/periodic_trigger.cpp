#include "sovo/driver/aravis/periodic_trigger.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "sovo/driver/live/host_clock.h"

namespace sovo::aravis {

std::int64_t TriggerGrid::next(std::int64_t now_ns, std::int64_t last_ns) const {
  const std::int64_t earliest = now_ns + lead_ns;
  const std::int64_t instant = (earliest / period_ns + 1) * period_ns;
  return instant == last_ns ? instant + period_ns : instant;
}

PeriodicTrigger::PeriodicTrigger(const TriggerGrid& grid, std::function<std::int64_t()> offset_ns,
                                 std::function<void(std::int64_t)> fire)
    : grid_(grid), offset_ns_(std::move(offset_ns)), fire_(std::move(fire)) {
  thread_ = std::thread([this] { run(); });
}

PeriodicTrigger::~PeriodicTrigger() {
  {
    const std::scoped_lock lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

bool PeriodicTrigger::sleep_until(std::int64_t time_ns) {
  using Clock = std::chrono::steady_clock;  // CLOCK_MONOTONIC
  const Clock::time_point time{std::chrono::nanoseconds(time_ns)};
  std::unique_lock lock(mutex_);
  return !wake_.wait_until(lock, time, [this] { return stop_; });
}

void PeriodicTrigger::run() {
  std::int64_t last = 0;
  while (true) {
    const std::int64_t offset = offset_ns_();
    const std::int64_t now = read_host_clock().monotonic_ns;
    const std::int64_t instant = grid_.next(now + offset, last);
    // A clock that was set may name an instant far away; it is looked at anew by then.
    const std::int64_t wake = std::min(instant - grid_.lead_ns - offset, now + 2 * grid_.period_ns);
    if (!sleep_until(wake)) return;
    fire_(instant);
    last = instant;
  }
}

}  // namespace sovo::aravis
