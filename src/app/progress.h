#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>

namespace sovo::app {

/// One line on the terminal that says how far a run is; nothing where stderr is not a terminal.
class Progress {
 public:
  /// `total`: frames to come, when that is known.
  explicit Progress(std::optional<std::size_t> total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Whether there is a terminal to show it on.
  bool enabled() const { return enabled_; }

  /// Shows that `frames` are done; at most ten times a second.
  void update(std::size_t frames, const std::string& note);

 private:
  using Clock = std::chrono::steady_clock;
  std::optional<std::size_t> total_;
  bool enabled_;
  bool shown_ = false;
  Clock::time_point start_;
  Clock::time_point last_;
};

}  // namespace sovo::app
