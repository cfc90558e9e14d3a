#include "sovo/bridge/camera_diagnostics.h"

#include "sovo/bridge/borrow.h"
#include "sovo/bridge/ros_conversion.h"
#include "sovo/bridge/topics.h"

namespace sovo::bridge {
namespace {

using StatusLevel = MessageTraits<msg::DiagnosticStatus>;
using Values = std::vector<std::pair<std::string, std::string>>;

std::uint8_t level_of(CameraState state) {
  if (state == CameraState::kStreaming) return StatusLevel::OK;
  return state == CameraState::kOpening ? StatusLevel::WARN : StatusLevel::ERROR;
}

Values values_of(const CameraReport& camera) {
  const CameraCounts& counts = camera.counts;
  Values values = {
      {"images", std::to_string(counts.images)},
      {"rate_hz", std::to_string(camera.rate_hz)},
      {"skipped", std::to_string(counts.skipped)},
      {"damaged", std::to_string(counts.damaged)},
      {"short", std::to_string(counts.short_images)},
      {"no_room", std::to_string(counts.no_room)},
      {"disconnects", std::to_string(counts.disconnects)},
      {"stalls", std::to_string(counts.stalls)},
      {"reconnects", std::to_string(counts.reconnects)},
      {"open_failures", std::to_string(counts.open_failures)},
      {"downtime_s", std::to_string(camera.downtime_s)},
      {"clock_drift_ppm", std::to_string(1e6 * camera.clock_drift)},
      {"clock_sigma_us", std::to_string(1e6 * camera.clock_sigma_s)},
      {"clock_steps", std::to_string(counts.clock_steps)},
  };
  for (const auto& [name, value] : camera.stream) values.emplace_back(name, value);
  if (camera.temperature_c) {
    values.emplace_back("temperature_c", std::to_string(*camera.temperature_c));
  }
  return values;
}

Values values_of(const LiveReport& report) {
  return {
      {"frames", std::to_string(report.frames)},
      {"queue_dropped", std::to_string(report.queue_dropped)},
      {"pairs", std::to_string(report.pairs.pairs)},
      {"unpaired_left", std::to_string(report.pairs.unpaired_left)},
      {"unpaired_right", std::to_string(report.pairs.unpaired_right)},
      {"out_of_order", std::to_string(report.pairs.out_of_order)},
      {"pair_error_us", std::to_string(1e6 * report.pair_error_s)},
      {"exposure_ms", std::to_string(1e3 * report.exposure_s)},
      {"gain_db", std::to_string(report.gain_db)},
      {"mean_grey", std::to_string(report.mean_grey)},
  };
}

}  // namespace

CameraDiagnosticsMessage::CameraDiagnosticsMessage(const std::string& process_name,
                                                   const LiveReport& report, std::int64_t now_ns) {
  for (const CameraReport& camera : report.cameras) {
    const std::string text = std::string(to_string(camera.state)) +
                             (camera.message.empty() ? "" : ": ") + camera.message;
    entries_.push_back({level_of(camera.state),
                        process_name + ": " + camera.name,
                        text,
                        camera.device,
                        values_of(camera),
                        {}});
  }
  const bool slow = report.queue_dropped > 0;
  entries_.push_back({slow ? StatusLevel::WARN : StatusLevel::OK,
                      process_name + ": frames",
                      slow ? "frames were dropped: this process is too slow" : "in time",
                      "",
                      values_of(report),
                      {}});
  for (Entry& entry : entries_) {
    for (const auto& [key, value] : entry.values) {
      entry.key_values.push_back({borrow(key), borrow(value)});
    }
    msg::DiagnosticStatus status{};
    status.level = entry.level;
    status.name = borrow(entry.name);
    status.message = borrow(entry.text);
    status.hardware_id = borrow(entry.device);
    borrow(status.values, entry.key_values);
    status_.push_back(status);
  }
  message_.header = {to_message(now_ns), borrow("")};
  borrow(message_.status, status_);
}

Result<CameraDiagnostics> CameraDiagnostics::open(const Participant& participant) {
  auto writer = Writer<msg::DiagnosticArray>::open(participant, topics::kDiagnostics,
                                                   topics::kDiagnosticsQos);
  if (!writer) return writer.failure();
  return CameraDiagnostics(std::move(*writer), participant.config().ns + ": camera");
}

Result<void> CameraDiagnostics::publish(const LiveReport& report, std::int64_t now_ns) {
  const CameraDiagnosticsMessage message(name_, report, now_ns);
  return writer_.write(message.message());
}

}  // namespace sovo::bridge
