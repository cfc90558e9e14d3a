#include "sovo/bridge/camera_health.h"

#include <cstdio>

namespace sovo::bridge {
namespace {

constexpr std::chrono::seconds kSilence(3);

std::string one_decimal(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.1f", value);
  return text;
}

}  // namespace

void CameraHealth::add(const StereoFrame& frame, Clock::time_point now) {
  gaps_.count(frame.sequence);
  ++now_.frames;
  now_.lost = gaps_.lost();
  if (!frame.left.valid) ++now_.left_missing;
  if (!frame.right.valid) ++now_.right_missing;
  left_dropped_ = frame.left.dropped;
  right_dropped_ = frame.right.dropped;
  last_frame_ = now;
}

DiagnosticReport CameraHealth::report(Clock::time_point now) {
  using Level = MessageTraits<msg::DiagnosticStatus>;
  const std::chrono::duration<double> span = now - last_report_;
  const double rate = last_report_ == Clock::time_point{}
                          ? 0.0
                          : static_cast<double>(now_.frames - reported_.frames) / span.count();
  DiagnosticReport report;
  report.name = process_name_;
  report.hardware_id = camera_;
  report.level = Level::OK;
  report.text = one_decimal(rate) + " frames a second";
  if (now_.left_missing > reported_.left_missing || now_.right_missing > reported_.right_missing) {
    report.level = Level::WARN;
    report.text += "; an image of the pair is missing";
  } else if (now_.lost > reported_.lost) {
    report.level = Level::WARN;
    report.text += "; frames of the device were lost";
  } else if (now - last_frame_ > kSilence) {
    report.level = Level::ERROR;
    report.text = now_.frames == 0 ? "no frame yet" : "no frame comes any more";
  }
  report.values = {
      {"frames", std::to_string(now_.frames)},
      {"rate_hz", one_decimal(rate)},
      {"lost", std::to_string(now_.lost)},
      {"left_missing", std::to_string(now_.left_missing)},
      {"right_missing", std::to_string(now_.right_missing)},
      {"left_dropped", std::to_string(left_dropped_)},
      {"right_dropped", std::to_string(right_dropped_)},
  };
  reported_ = now_;
  last_report_ = now;
  return report;
}

}  // namespace sovo::bridge
