#include "sovo/app/live_publication.h"

#include <chrono>
#include <random>

#include "sovo/app/calibration_reminder.h"
#include "sovo/app/failure.h"
#include "sovo/app/frame_input.h"
#include "sovo/app/stop_signal.h"
#include "sovo/bridge/camera_diagnostics.h"
#include "sovo/bridge/camera_publisher.h"
#include "sovo/driver/live/host_clock.h"

namespace sovo::app {
namespace {

using Clock = std::chrono::steady_clock;

std::uint64_t new_session() {
  std::random_device device;
  return (std::uint64_t{device()} << 32) | device();
}

/// Says in the log what changed with a camera.
class CameraLog {
 public:
  void update(const CameraReport& camera) {
    if (camera.state == CameraState::kStreaming && camera.counts.reconnects != reconnects_) {
      spdlog::info("{}: streaming again after {:.1f} s: {}", camera.name, camera.downtime_s,
                   camera.device);
    } else if (camera.state != state_ && camera.state == CameraState::kStreaming) {
      spdlog::info("{}: streaming: {}", camera.name, camera.device);
    } else if (camera.state != CameraState::kStreaming && camera.message != message_) {
      spdlog::warn("{}: {}: {}", camera.name, to_string(camera.state), camera.message);
    } else if (camera.counts.dropped() != dropped_) {
      spdlog::warn("{}: {} images lost so far ({} skipped, {} damaged, {} short, {} without room)",
                   camera.name, camera.counts.dropped(), camera.counts.skipped,
                   camera.counts.damaged, camera.counts.short_images, camera.counts.no_room);
    }
    state_ = camera.state;
    message_ = camera.message;
    reconnects_ = camera.counts.reconnects;
    dropped_ = camera.counts.dropped();
  }

 private:
  CameraState state_ = CameraState::kOpening;
  std::string message_;
  std::uint64_t reconnects_ = 0;
  std::uint64_t dropped_ = 0;
};

/// The last line of every camera.
void log_summary(const LiveReport& report) {
  for (const CameraReport& camera : report.cameras) {
    const CameraCounts& c = camera.counts;
    spdlog::info(
        "{}: {} images, {} skipped, {} damaged, {} short, {} without room, {} disconnects, {} "
        "stalls, {} reconnects",
        camera.name, c.images, c.skipped, c.damaged, c.short_images, c.no_room, c.disconnects,
        c.stalls, c.reconnects);
  }
  if (report.cameras.size() > 1) {
    spdlog::info("{} pairs, {} left and {} right images without the other", report.pairs.pairs,
                 report.pairs.unpaired_left, report.pairs.unpaired_right);
  }
  if (report.queue_dropped > 0) {
    spdlog::warn("{} frames dropped: publishing was too slow", report.queue_dropped);
  }
}

class LivePublication {
 public:
  LivePublication(const LiveInput& input, bridge::CameraPublisher& publisher,
                  CalibrationReminder& calibration, bridge::CameraDiagnostics& diagnostics,
                  StopSignal& stop)
      : source_(*input.source),
        publisher_(publisher),
        calibration_(calibration),
        diagnostics_(diagnostics),
        stop_(stop) {}

  /// `most`: frames after which it ends; 0 for no end.
  int run(int most) {
    const std::uint64_t session = new_session();
    std::uint64_t published = 0;
    while (!stop_.requested() && (most == 0 || published < static_cast<std::uint64_t>(most))) {
      source_.want_colour(publisher_.wants_colour());
      SourceResult next = source_.next(std::chrono::milliseconds(100));
      tell();
      calibration_.remind_new_listeners();
      if (next.state != SourceState::kFrame) continue;
      next.frame.session = session;
      const auto sent = publisher_.publish(next.frame, source_.colour());
      if (!sent) return fail(kFailed, sent.error());
      ++published;
    }
    log_summary(source_.report());
    spdlog::info("published {} frames", published);
    return published > 0 ? kOk : fail(kFailed, "no frame could be published");
  }

 private:
  /// Once a second: state to the log and to /diagnostics.
  void tell() {
    const auto now = Clock::now();
    if (now - last_told_ < std::chrono::seconds(1)) return;
    last_told_ = now;
    const LiveReport report = source_.report();
    logs_.resize(report.cameras.size());
    for (std::size_t i = 0; i < logs_.size(); ++i) logs_[i].update(report.cameras[i]);
    const auto sent = diagnostics_.publish(report, read_host_clock().utc_ns);
    if (!sent) spdlog::warn("{}", sent.error());
  }

  LiveSource& source_;
  bridge::CameraPublisher& publisher_;
  CalibrationReminder& calibration_;
  bridge::CameraDiagnostics& diagnostics_;
  StopSignal& stop_;
  std::vector<CameraLog> logs_;
  Clock::time_point last_told_{};
};

}  // namespace

int publish_live(const AppConfig& config, const std::function<Result<LiveInput>()>& open) {
  StopSignal stop;  // before the threads of source and bus
  auto input = open();
  if (!input) return fail(kBadInput, input.error());
  for (const std::string& note : input->notes) spdlog::warn("{}", note);
  auto participant = bridge::Participant::open(config.dds, "camera");
  if (!participant) return fail(kFailed, participant.error());
  for (const std::string& note : participant->notes()) spdlog::info("{}", note);
  StereoCameras cameras = to_cameras(input->calibration);
  if (!config.camera.name.empty()) cameras.rig.name = config.camera.name;
  const std::int64_t stamp_ns = read_host_clock().utc_ns;
  auto publisher = bridge::CameraPublisher::open(*participant, cameras, stamp_ns);
  if (!publisher) return fail(kFailed, publisher.error());
  auto diagnostics = bridge::CameraDiagnostics::open(*participant);
  if (!diagnostics) return fail(kFailed, diagnostics.error());
  CalibrationReminder reminder(config.dds.transport, *participant, *publisher, cameras, stamp_ns);
  return LivePublication(*input, *publisher, reminder, *diagnostics, stop)
      .run(config.camera.frames);
}

}  // namespace sovo::app
