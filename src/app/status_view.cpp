#include "sovo/app/status_view.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <utility>

#include "sovo/bridge/ros_conversion.h"
#include "sovo/odometry/odometry_output.h"

namespace sovo::app {
namespace {

constexpr std::chrono::seconds kRateWindow(2);
constexpr std::chrono::seconds kClockPatience(2);     // a replay publishes it all the time
constexpr std::chrono::seconds kRecorderPatience(3);  // it speaks once a second
constexpr double kOldestLive = 10.0;                  // [s]; older stamps are those of a recording

std::string text_or_dash(const char* text) { return text == nullptr || *text == '\0' ? "-" : text; }

std::string stage_lines(const bridge::msg::VoStatus& s) {
  std::string text = fmt::format("{:<22}{:>9}{:>9}{:>9}\n", "stage [ms]", "last", "mean", "max");
  for (std::uint32_t i = 0; i < s.stages._length; ++i) {
    const auto& stage = s.stages._buffer[i];
    text += fmt::format("{:<22}{:>9.2f}{:>9.2f}{:>9.2f}\n", text_or_dash(stage.name), stage.last_ms,
                        stage.mean_ms, stage.max_ms);
  }
  return text;
}

}  // namespace

std::string status_screen(const bridge::msg::VoStatus& s, const std::string& surroundings) {
  const auto state = to_string(static_cast<OdometryState>(s.state));
  std::string text = fmt::format("state       {} ({})\n", state, text_or_dash(s.reason));
  text += fmt::format("frame       {} of session {:x}; latency {:.1f} ms, queue {}\n", s.sequence,
                      s.session, 1e3 * s.latency_s, s.queue_depth);
  text += fmt::format("received    {}; lost in transport {}, dropped {}, refused {}\n", s.received,
                      s.lost_transport, s.dropped_queue, s.rejected);
  text += fmt::format("map         segment {}, {} keyframes, {} points, {} inliers\n", s.segment,
                      s.keyframes, s.points, s.inliers);
  text += fmt::format("tracking    residual {:.2f} grey levels (by features: px), ", s.residual);
  text += fmt::format("pair error {:.3f} ms\n", 1e3 * s.sync_error_s);
  text += fmt::format("distance    {:.2f} m, {} resets\n", s.distance_m, s.reset_counter);
  text +=
      fmt::format("command     {} {}\n", s.last_command_id, text_or_dash(s.last_command_result));
  return text + surroundings + "\n" + stage_lines(s);
}

void StatusSurroundings::add(const bridge::msg::VoStatus&, Clock::time_point now) {
  arrivals_.push_back(now);
  while (now - arrivals_.front() > kRateWindow) arrivals_.pop_front();
}

void StatusSurroundings::add(const bridge::msg::ScaledOdometry& m) {
  scale_ = {m.scale_valid, m.log_scale, m.log_scale_sigma, m.scale_age_s};
}

void StatusSurroundings::add(const bridge::msg::RecorderStatus& m, Clock::time_point now) {
  Recorder recorder = {m.recording,
                       text_or_dash(m.file),
                       text_or_dash(m.reason),
                       m.bytes,
                       m.free_bytes,
                       m.dropped,
                       0.0,
                       now};
  if (recorder_ && recorder_->file == recorder.file && m.bytes >= recorder_->bytes) {
    const double seconds = std::chrono::duration<double>(now - recorder_->heard).count();
    if (seconds > 0.0) {
      recorder.bytes_per_s = static_cast<double>(m.bytes - recorder_->bytes) / seconds;
    }
  }
  recorder_ = std::move(recorder);
}

void StatusSurroundings::add(const bridge::msg::Clock& m, Clock::time_point now) {
  clock_ = {bridge::stamp_ns(m.clock), now};
}

/// How old a stamp is: by the replay's clock while there is one.
std::string StatusSurroundings::age(std::int64_t stamp_ns, Clock::time_point now,
                                    std::int64_t utc_ns) const {
  const bool replayed = clock_ && now - clock_->heard < kClockPatience;
  const double seconds =
      1e-9 * static_cast<double>((replayed ? clock_->time_ns : utc_ns) - stamp_ns);
  if (replayed) return fmt::format("newest frame {:.2f} s old by /clock", seconds);
  if (seconds > kOldestLive) return "frames of a recording";
  return fmt::format("newest frame {:.2f} s old", seconds);
}

std::string StatusSurroundings::scale_text() const {
  if (!scale_ || !scale_->valid) return "not measured";
  return fmt::format("{:.4f} +- {:.2f} %, measured {:.1f} s ago", std::exp(scale_->log_scale),
                     100 * scale_->sigma, scale_->age_s);
}

std::string StatusSurroundings::disk_text(Clock::time_point now) const {
  if (!recorder_ || now - recorder_->heard > kRecorderPatience) return "no word of a recorder";
  const Recorder& r = *recorder_;
  const std::string left = fmt::format("{:.1f} GB free, {} dropped",
                                       1e-9 * static_cast<double>(r.free_bytes), r.dropped);
  if (!r.recording) return fmt::format("not recording ({}); {}", r.reason, left);
  return fmt::format("recording {}, {:.1f} MB, {:.1f} MB/s; {}", r.file,
                     1e-6 * static_cast<double>(r.bytes), 1e-6 * r.bytes_per_s, left);
}

std::string StatusSurroundings::text(const bridge::msg::VoStatus& status, Clock::time_point now,
                                     std::int64_t utc_ns) const {
  double rate = 0.0;
  if (arrivals_.size() > 1) {
    const std::chrono::duration<double> span = arrivals_.back() - arrivals_.front();
    rate = static_cast<double>(arrivals_.size() - 1) / span.count();
  }
  return fmt::format("rate        {:.1f} Hz; {}\nscale       {}\ndisk        {}\n", rate,
                     age(bridge::stamp_ns(status.header.stamp), now, utc_ns), scale_text(),
                     disk_text(now));
}

StatusLine::StatusLine(Trajectory truth) : drift_(std::move(truth)) {}

void StatusLine::add(const bridge::msg::VoStatus& status,
                     std::chrono::steady_clock::time_point now) {
  constexpr std::chrono::seconds kWindow(2);
  any_ = true;
  arrivals_.push_back(now);
  while (now - arrivals_.front() > kWindow) arrivals_.pop_front();
  received_ = status.received;
  dropped_ = status.dropped_queue + status.lost_transport;
  latency_s_ = status.latency_s;
  state_ = to_string(static_cast<OdometryState>(status.state));
  points_ = status.points;
  distance_m_ = status.distance_m;
}

void StatusLine::add(const bridge::msg::ScaledOdometry& odometry) {
  scale_valid_ = odometry.scale_valid;
  log_scale_ = odometry.log_scale;
  log_scale_sigma_ = odometry.log_scale_sigma;
  const auto& pose = odometry.pose.pose;
  if (!scale_valid_ || !T_base_left_ || !bridge::is_rigid(pose.position, pose.orientation)) return;
  const SE3 T_odom_base = bridge::to_se3(pose.position, pose.orientation);
  const auto drift = drift_.update(bridge::stamp_ns(odometry.header.stamp), odometry.segment,
                                   T_odom_base * *T_base_left_);
  if (drift) newest_drift_ = drift;
}

void StatusLine::add(const bridge::msg::StereoCalibration& calibration) {
  const auto& t = calibration.base_from_left;
  if (bridge::is_rigid(t.translation, t.rotation)) {
    T_base_left_ = bridge::to_se3(t.translation, t.rotation);
  }
}

double StatusLine::rate() const {
  if (arrivals_.size() < 2) return 0.0;
  const std::chrono::duration<double> span = arrivals_.back() - arrivals_.front();
  return static_cast<double>(arrivals_.size() - 1) / span.count();
}

std::optional<std::string> StatusLine::text() const {
  if (!any_) return std::nullopt;
  const std::size_t expected = drift_.truth().size();
  std::string text = fmt::format("frame {}", received_);
  if (expected > 0) text += fmt::format(" of {}", expected);
  text += fmt::format(", {:.1f} Hz, latency {:.0f} ms, {}, {} points, {:.2f} m", rate(),
                      1e3 * latency_s_, state_, points_, distance_m_);
  if (dropped_ > 0) text += fmt::format(", {} dropped", dropped_);
  if (scale_valid_) {
    text += fmt::format(", scale {:.4f} +- {:.2f} %", std::exp(log_scale_), 100 * log_scale_sigma_);
  }
  if (newest_drift_) {
    text += fmt::format(", drift {:.3f} m", newest_drift_->drift_m);
    if (newest_drift_->path_m > 0.5) {
      text += fmt::format(" ({:.2f} %)", 100 * newest_drift_->drift_m / newest_drift_->path_m);
    }
  }
  return text;
}

}  // namespace sovo::app
