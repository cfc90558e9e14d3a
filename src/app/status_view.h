#pragma once

#include <chrono>
#include <deque>
#include <optional>
#include <string>

#include "message_traits.h"
#include "sovo/eval/live_drift.h"

namespace sovo::app {

/// The state of the odometry process as a screen of text.
std::string status_screen(const bridge::msg::VoStatus& status);

/// The state of the odometry process in one line: what came in over the bus so far.
class StatusLine {
 public:
  /// `truth`: of the left camera, with the stamps of the frames; empty when it is not known.
  explicit StatusLine(Trajectory truth);

  void add(const bridge::msg::VoStatus& status, std::chrono::steady_clock::time_point now);
  void add(const bridge::msg::ScaledOdometry& odometry);
  void add(const bridge::msg::StereoCalibration& calibration);

  /// "frame 120 of 628, 19.9 Hz, latency 41 ms, TRACKING, 2012 points, 6.80 m, scale 1.0002 +-
  /// 0.06 %, drift 0.004 m (0.06 %)"; nothing before the first status.
  std::optional<std::string> text() const;

 private:
  double rate() const;

  LiveDrift drift_;
  std::optional<SE3> T_base_left_;
  std::optional<LiveDrift::Value> newest_drift_;
  std::deque<std::chrono::steady_clock::time_point> arrivals_;  ///< Of the last seconds.
  bool any_ = false;
  std::uint64_t received_ = 0;
  std::uint64_t dropped_ = 0;
  double latency_s_ = 0.0;
  std::string state_;
  std::uint32_t points_ = 0;
  double distance_m_ = 0.0;
  bool scale_valid_ = false;
  double log_scale_ = 0.0, log_scale_sigma_ = 0.0;
};

}  // namespace sovo::app
