#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "sovo/app/commands.h"
#include "sovo/app/config_options.h"
#include "sovo/app/failure.h"
#include "sovo/app/frame_input.h"
#include "sovo/app/odometry_session.h"
#include "sovo/app/stop_signal.h"
#include "sovo/bridge/command_subscriber.h"
#include "sovo/bridge/map_publisher.h"
#include "sovo/bridge/replay_clock.h"
#include "sovo/bridge/ros_stereo_subscriber.h"
#include "sovo/bridge/stereo_subscriber.h"
#include "sovo/bridge/vo_publisher.h"
#include "sovo/io/calibration.h"

namespace sovo::app {
namespace {

using Clock = std::chrono::steady_clock;

/// The odometry process: frames and commands from the bus in, odometry out.
class VoProcess {
 public:
  VoProcess(const AppConfig& config, bridge::StereoFeed& source,
            bridge::CommandSubscriber& commands, bridge::ReplayClock& replay_clock,
            bridge::VoPublisher& publisher, bridge::MapPublisher* map)
      : config_(config),
        source_(source),
        commands_(commands),
        replay_clock_(replay_clock),
        publisher_(publisher),
        map_(map),
        session_(config, source.cameras(), {&publisher, map}, {publisher.timings()},
                 [map](const LoopSink::Map& m) {
                   if (map != nullptr) map->set_map(m.T_map_odom, m.places, m.closure.has_value());
                 }) {
    publisher.set_cameras(session_.tracked_camera(), source.cameras().rig.left);
  }

  /// Works until the user stops it, the source has gone or enough frames were taken; returns an
  /// exit code.
  int run(StopSignal& stop) {
    bool source_ok = true;
    while (source_ok && !stop.requested() && !is_done()) {
      obey_commands();
      SourceResult next = source_.next(std::chrono::milliseconds(50));
      switch (next.state) {
        case SourceState::kFrame:
          take(next.frame);
          break;
        case SourceState::kTimeout:
          break;
        case SourceState::kBadFrame:
          spdlog::warn("{}", next.message);
          break;
        case SourceState::kFailed:
        case SourceState::kEndOfStream:
          spdlog::error("{}", next.message);
          source_ok = false;
          break;
      }
    }
    const int code = session_.finish();
    report_losses();
    return source_ok ? code : kFailed;
  }

 private:
  bool is_done() const {
    if (config_.camera.frames > 0 && taken_ >= config_.camera.frames) return true;
    const std::chrono::duration<double> idle(config_.node.idle_exit_s);
    return taken_ > 0 && idle.count() > 0.0 && Clock::now() - last_frame_ > idle;
  }

  void take(const StereoFrame& frame) {
    ++taken_;
    follow_session(frame);
    camera_frame_ = frame.frame_id;
    if (auto heard = replay_clock_.update(); !heard) spdlog::warn("{}", heard.error());
    publisher_.set_feed(feed());
    if (paused_) {
      publisher_.on_frame(paused_output(frame));
    } else {
      session_.process(frame);
    }
    report_failed_writes(publisher_, &reported_failures_);
    if (map_ != nullptr) report_failed_writes(*map_, &reported_map_failures_);
    last_frame_ = Clock::now();  // the time that a frame took is no idleness
  }

  /// Tells of writes that have failed since the last time.
  template <class Publisher>
  static void report_failed_writes(const Publisher& publisher, std::uint64_t* reported) {
    if (publisher.failed_writes() <= *reported) return;
    *reported = publisher.failed_writes();
    spdlog::warn("not published: {}", publisher.last_failure());
  }

  /// Another session is another run of the camera: nothing connects it with the map.
  void follow_session(const StereoFrame& frame) {
    if (last_ && last_->session != frame.session) {
      const bool goes_back = frame.stamp_ns <= last_->stamp_ns;
      spdlog::info(
          "a new source, session {:x}: {}", frame.session,
          goes_back ? "its stamps are older, the odometry begins anew" : "a new segment begins");
      goes_back ? session_.restart() : session_.reset();
    }
    last_ = LastFrame{frame.session, frame.stamp_ns};
  }

  bridge::FeedStatus feed() const {
    const bridge::FeedCounters counters = source_.counters();
    bridge::FeedStatus feed;
    feed.lost_transport = counters.lost_transport;
    feed.dropped_queue = counters.dropped_queue;
    feed.rejected = counters.rejected + counters.foreign;
    feed.last_command_id = commands_.last_id();
    feed.last_command_result = commands_.last_result();
    feed.latency_origin_ns = source_.latency_origin_ns() + replay_clock_.lag_ns().value_or(0);
    feed.camera_frame = camera_frame_;
    if (const LoopSink* loops = session_.loops()) {
      const LoopCounts counts = loops->counts();
      feed.loops = bridge::LoopStatus{counts.places, counts.closures, loops->dropped()};
    }
    return feed;
  }

  OdometryOutput paused_output(const StereoFrame& frame) const {
    OdometryOutput output;
    output.stamp_ns = frame.stamp_ns;
    output.session = frame.session;
    output.sequence = frame.sequence;
    output.state = OdometryState::kStopped;
    output.reason = "paused; sovo command resume goes on";
    output.received = source_.counters().received;
    return output;
  }

  void obey_commands() {
    for (const bridge::Command& command : commands_.poll()) {
      const std::string result = obey(command);
      spdlog::info("command {:x}: {}", command.id, result);
      commands_.answer(command, result);
    }
  }

  std::string obey(const bridge::Command& command) {
    switch (command.kind) {
      case bridge::CommandKind::kReset:
        if (command.T_odom_base) {
          return "refused: a reset goes on from the last pose; leave the command's pose at zeros";
        }
        session_.reset();
        return "done: a new segment begins";
      case bridge::CommandKind::kPause:
        paused_ = true;
        return "done: paused";
      case bridge::CommandKind::kResume:
        paused_ = false;
        return "done: resumed";
    }
    return "refused: unknown command";
  }

  void report_losses() const {
    const bridge::FeedCounters counters = source_.counters();
    spdlog::info("received {} frames; lost in transport {}, dropped {}, malformed {}, foreign {}",
                 counters.received, counters.lost_transport, counters.dropped_queue,
                 counters.rejected, counters.foreign);
  }

  struct LastFrame {
    std::uint64_t session = 0;
    std::int64_t stamp_ns = 0;
  };

  const AppConfig& config_;
  bridge::StereoFeed& source_;
  bridge::CommandSubscriber& commands_;
  bridge::ReplayClock& replay_clock_;
  bridge::VoPublisher& publisher_;
  bridge::MapPublisher* map_;  ///< Null: loops are not closed.
  OdometrySession session_;
  bool paused_ = false;
  int taken_ = 0;
  std::optional<LastFrame> last_;
  std::string camera_frame_;
  Clock::time_point last_frame_;
  std::uint64_t reported_failures_ = 0;
  std::uint64_t reported_map_failures_ = 0;
};

Result<std::optional<StereoCameras>> read_calibration(const std::string& path) {
  if (path.empty()) return std::optional<StereoCameras>();
  const auto calibration = load_calibration(path);
  if (!calibration) return calibration.failure();
  return std::optional(to_cameras(*calibration));
}

/// Waits until the source's calibration has come; says now and then what is missing. False when
/// the user stops.
bool wait_for_calibration(bridge::StereoFeed& source, StopSignal& stop) {
  std::string told;
  auto last_told = Clock::now() - std::chrono::seconds(10);
  while (!stop.requested()) {
    const auto found = source.wait_for_calibration(std::chrono::milliseconds(100));
    if (found) return true;
    if (found.error() == told && Clock::now() - last_told < std::chrono::seconds(10)) continue;
    told = found.error();
    last_told = Clock::now();
    spdlog::warn("waiting: {}", told);
  }
  return false;
}

/// Our own frames, or those of two image topics.
Result<std::unique_ptr<bridge::StereoFeed>> open_source(const AppConfig& config,
                                                        const bridge::Participant& participant,
                                                        std::optional<StereoCameras> calibration) {
  using Source = std::unique_ptr<bridge::StereoFeed>;
  if (config.node.left.empty()) {
    auto source = bridge::StereoSubscriber::open(participant, {}, std::move(calibration));
    if (!source) return source.failure();
    return Source(std::move(*source));
  }
  bridge::RosStereoConfig topics;
  topics.left = config.node.left;
  topics.right = config.node.right;
  topics.tolerance_s = config.node.pair_tolerance_s;
  auto source = bridge::RosStereoSubscriber::open(participant, topics, std::move(calibration));
  if (!source) return source.failure();
  return Source(std::move(*source));
}

int serve(const AppConfig& config) {
  if (auto writable = check_outputs(config.output); !writable) {
    return fail(kUsage, writable.error());
  }
  auto calibration = read_calibration(config.camera.calibration);
  if (!calibration) return fail(kBadInput, calibration.error());
  StopSignal stop;  // before the threads of bus and odometry
  auto participant = bridge::Participant::open(config.dds, "vo");
  if (!participant) return fail(kFailed, participant.error());
  for (const std::string& note : participant->notes()) spdlog::info("{}", note);

  auto source = open_source(config, *participant, std::move(*calibration));
  if (!source) return fail(kFailed, source.error());
  auto commands = bridge::CommandSubscriber::open(*participant);
  if (!commands) return fail(kFailed, commands.error());
  auto replay_clock = bridge::ReplayClock::open(*participant);
  if (!replay_clock) return fail(kFailed, replay_clock.error());
  if (!wait_for_calibration(**source, stop)) {
    return fail(kFailed, "stopped before a calibration came; no frame was tracked");
  }
  bridge::VoPublisherConfig publishing;
  publishing.publish_tf = config.node.publish_tf;
  publishing.publish_odom = config.odometry.mode != OdometryMode::kMono;
  auto publisher =
      bridge::VoPublisher::open(*participant, publishing, (*source)->rig().T_base_left);
  if (!publisher) return fail(kFailed, publisher.error());
  std::unique_ptr<bridge::MapPublisher> map;
  if (config.loops.enabled) {
    auto opened = bridge::MapPublisher::open(*participant, publishing.publish_tf,
                                             (*source)->rig().T_base_left);
    if (!opened) return fail(kFailed, opened.error());
    map = std::move(*opened);
  }
  spdlog::info("tracking frames of {}", config.node.left.empty()
                                            ? participant->topic("stereo")
                                            : config.node.left + " and " + config.node.right);
  return VoProcess(config, **source, *commands, *replay_clock, **publisher, map.get()).run(stop);
}

}  // namespace

void add_vo_command(const Command& program) {
  const Command command =
      program.add_command("vo", "The odometry process: stereo in, odometry out");
  auto options = std::make_shared<ConfigOptions>(command);
  options
      ->value("--calib", "camera.calibration", "Calibration file, instead of the camera's", "FILE")
      .value("--left", "node.left", "Left image topic of any ROS 2 driver", "TOPIC")
      .value("--right", "node.right", "Its right one; calibration from camera_info beside", "TOPIC")
      .value("--frames", "camera.frames", "End after so many frames", "N")
      .value("--idle-exit", "node.idle_exit_s",
             "End when no frame came this long after the last one", "SECONDS");
  add_odometry_options(*options);
  add_dds_options(*options);
  command.action([options] {
    const auto config = options->load();
    return config ? serve(*config) : fail(kUsage, config.error());
  });
}

}  // namespace sovo::app
