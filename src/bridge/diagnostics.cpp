#include "sovo/bridge/diagnostics.h"

#include <cmath>
#include <iomanip>
#include <sstream>

#include "sovo/bridge/borrow.h"
#include "sovo/bridge/ros_conversion.h"

namespace sovo::bridge {
namespace {

using Level = MessageTraits<msg::DiagnosticStatus>;

/// Pitch, yaw and roll.
std::string in_degrees(const Vec3& turn) {
  std::ostringstream out;
  out << std::fixed << std::setprecision(3);
  const Vec3 degrees = 180.0 / M_PI * turn;
  out << degrees.x() << " " << degrees.y() << " " << degrees.z();
  return out.str();
}

}  // namespace

std::uint8_t diagnostic_level(OdometryState state) {
  if (state == OdometryState::kTracking) return Level::OK;
  return state == OdometryState::kLost ? Level::ERROR : Level::WARN;
}

DiagnosticReport describe(const std::string& process_name, const OdometryOutput& output,
                          const FeedStatus& feed, bool stale) {
  DiagnosticReport report;
  report.name = process_name;
  report.level = stale ? std::uint8_t{Level::STALE} : diagnostic_level(output.state);
  if (output.decalibrated && report.level == Level::OK) report.level = Level::WARN;
  report.text = stale ? "no frames come; last state " : "";
  report.text += to_string(output.state);
  if (!output.reason.empty()) report.text += ": " + output.reason;
  report.values = {
      {"received", std::to_string(output.received)},
      {"lost_transport", std::to_string(feed.lost_transport)},
      {"dropped_queue", std::to_string(output.dropped_queue + feed.dropped_queue)},
      {"rejected", std::to_string(output.rejected + feed.rejected)},
      {"segment", std::to_string(output.segment)},
      {"halvings", std::to_string(output.halvings)},
      {"corner_light", std::to_string(output.corner_light)},
      {"right_turn_deg", in_degrees(output.right_turn)},
      {"focal_error", std::to_string(output.focal_error)},
      {"co_moving_share", std::to_string(output.co_moving_share)},
      {"points", std::to_string(output.points)},
      {"inliers", std::to_string(output.inliers)},
      {"keyframes", std::to_string(output.keyframes)},
      {"residual", std::to_string(output.residual)},
      {"scale_valid", output.scale_valid ? "true" : "false"},
      {"log_scale_sigma", std::to_string(output.log_scale_sigma)},
      {"scale_age_s", std::to_string(output.scale_age_s)},
      {"scale_verdict", to_string(output.scale_verdict)},
      {"distance_m", std::to_string(output.distance_m)},
  };
  if (feed.loops) {
    report.values.emplace_back("loop_places", std::to_string(feed.loops->places));
    report.values.emplace_back("loops_closed", std::to_string(feed.loops->closed));
    report.values.emplace_back("loop_dropped", std::to_string(feed.loops->dropped));
  }
  return report;
}

DiagnosticsMessage::DiagnosticsMessage(DiagnosticReport report, std::int64_t now_ns)
    : report_(std::move(report)) {
  for (const auto& [key, value] : report_.values) {
    key_values_.push_back({borrow(key), borrow(value)});
  }
  msg::DiagnosticStatus status{};
  status.level = report_.level;
  status.name = borrow(report_.name);
  status.message = borrow(report_.text);
  status.hardware_id = borrow(report_.hardware_id);
  borrow(status.values, key_values_);
  status_.push_back(status);
  message_.header = {to_message(now_ns), borrow("")};
  borrow(message_.status, status_);
}

}  // namespace sovo::bridge
