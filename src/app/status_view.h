#pragma once

#include <chrono>
#include <deque>
#include <optional>
#include <string>

#include "message_traits.h"
#include "sovo/eval/live_drift.h"

namespace sovo::app {

/// What other topics add to the state of the odometry process.
class StatusSurroundings {
 public:
  using Clock = std::chrono::steady_clock;

  void add(const bridge::msg::VoStatus& status, Clock::time_point now);
  void add(const bridge::msg::ScaledOdometry& m);
  void add(const bridge::msg::RecorderStatus& m, Clock::time_point now);
  void add(const bridge::msg::Clock& m, Clock::time_point now);

  /// Lines of text: rate, scale and disk. `utc_ns`: the time of day, which `/clock` stands in for
  /// while a replay publishes it.
  std::string text(const bridge::msg::VoStatus& status, Clock::time_point now,
                   std::int64_t utc_ns) const;

 private:
  std::string age(std::int64_t stamp_ns, Clock::time_point now, std::int64_t utc_ns) const;
  std::string scale_text() const;
  std::string disk_text(Clock::time_point now) const;

  struct Recorder {
    bool recording = false;
    std::string file, reason;
    std::uint64_t bytes = 0, free_bytes = 0, dropped = 0;
    double bytes_per_s = 0.0;
    Clock::time_point heard;
  };
  struct ReplayClock {
    std::int64_t time_ns = 0;
    Clock::time_point heard;
  };
  struct Scale {
    bool valid = false;
    double log_scale = 0.0, sigma = 0.0, age_s = 0.0;
  };

  std::deque<Clock::time_point> arrivals_;  ///< Of the last seconds.
  std::optional<Recorder> recorder_;
  std::optional<ReplayClock> clock_;
  std::optional<Scale> scale_;
};

/// The state of the odometry process as a screen of text; `surroundings`: lines of others.
std::string status_screen(const bridge::msg::VoStatus& status, const std::string& surroundings);

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
