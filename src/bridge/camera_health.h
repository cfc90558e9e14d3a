#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "sovo/bridge/diagnostics.h"
#include "sovo/bridge/session_lock.h"
#include "sovo/image/stereo_frame.h"

namespace sovo::bridge {

/// Counts what a camera process publishes, for /diagnostics. For one thread.
class CameraHealth {
 public:
  using Clock = std::chrono::steady_clock;

  CameraHealth(std::string process_name, std::string camera)
      : process_name_(std::move(process_name)), camera_(std::move(camera)) {}

  void add(const StereoFrame& frame, Clock::time_point now);

  /// State since the last report: a warning when a side was missing or frames were lost, an error
  /// when no frame came for three seconds.
  DiagnosticReport report(Clock::time_point now);

 private:
  struct Counts {
    std::uint64_t frames = 0;
    std::uint64_t left_missing = 0;
    std::uint64_t right_missing = 0;
    std::uint64_t lost = 0;  ///< Frames of the device that were not published.
  };

  std::string process_name_;
  std::string camera_;
  GapCounter gaps_;
  Counts now_;
  Counts reported_;
  std::uint64_t left_dropped_ = 0;
  std::uint64_t right_dropped_ = 0;
  Clock::time_point last_frame_{};
  Clock::time_point last_report_{};
};

}  // namespace sovo::bridge
