#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>

namespace sovo::aravis {

/// When exposures shall begin: at the whole multiples of a period of a clock. Two cameras that keep
/// to the same clock and period expose together, without knowing of each other.
struct TriggerGrid {
  std::int64_t period_ns = 0;
  std::int64_t lead_ns = 0;  ///< How long before it the trigger is sent; less than a period.

  /// The next instant that can still be announced `lead_ns` ahead, and is later than `last_ns`'s.
  std::int64_t next(std::int64_t now_ns, std::int64_t last_ns) const;
};

/// Fires on a thread of its own at the instants of a grid, less the lead.
class PeriodicTrigger {
 public:
  /// `offset_ns`: the grid's clock less CLOCK_MONOTONIC, asked for each time. `fire`: gets the
  /// instant by the grid's clock. Both are called on the trigger's thread.
  PeriodicTrigger(const TriggerGrid& grid, std::function<std::int64_t()> offset_ns,
                  std::function<void(std::int64_t)> fire);
  ~PeriodicTrigger();
  PeriodicTrigger(const PeriodicTrigger&) = delete;
  PeriodicTrigger& operator=(const PeriodicTrigger&) = delete;

 private:
  void run();
  /// Sleeps until CLOCK_MONOTONIC shows `time_ns`; false when it shall stop.
  bool sleep_until(std::int64_t time_ns);

  const TriggerGrid grid_;
  const std::function<std::int64_t()> offset_ns_;
  const std::function<void(std::int64_t)> fire_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool stop_ = false;
  std::thread thread_;  ///< Last: it uses the members above.
};

}  // namespace sovo::aravis
