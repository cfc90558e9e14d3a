#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

namespace sovo::bridge {

/// A thread for work that must never hold up frames: it runs with the lowest priority that an
/// ordinary thread can have, so that it gets what time the others leave.
class BackgroundWorker {
 public:
  /// Calls `work` whenever it was woken, and at the latest every `period`. `name`: for tools that
  /// list threads, at most 15 characters.
  BackgroundWorker(const std::string& name, std::chrono::milliseconds period,
                   std::function<void()> work);
  /// Waits for a call of `work` that is under way.
  ~BackgroundWorker();
  BackgroundWorker(const BackgroundWorker&) = delete;
  BackgroundWorker& operator=(const BackgroundWorker&) = delete;

  void wake();

  /// Calls of `work` that ended with an exception, which is lost work and nothing worse.
  std::uint64_t failures() const { return failures_; }

 private:
  void run(const std::string& name);

  std::chrono::milliseconds period_;
  std::function<void()> work_;
  std::atomic<std::uint64_t> failures_{0};
  std::mutex mutex_;
  std::condition_variable changed_;
  bool woken_ = false;
  bool stopping_ = false;
  std::thread thread_;
};

/// Tells when something that happens at most so often is due.
class Pace {
 public:
  using Clock = std::chrono::steady_clock;

  explicit Pace(std::chrono::nanoseconds period) : period_(period) {}

  /// Whether it is due now; the next time is then a period later. Lost time is not made up for.
  bool due(Clock::time_point now = Clock::now()) {
    if (now < next_) return false;
    next_ = now - next_ < period_ ? next_ + period_ : now + period_;
    return true;
  }

 private:
  std::chrono::nanoseconds period_;
  Clock::time_point next_{};
};

}  // namespace sovo::bridge
