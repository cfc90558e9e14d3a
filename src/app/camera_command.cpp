#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <random>
#include <thread>
#include <utility>

#include "sovo/app/calibration_reminder.h"
#include "sovo/app/commands.h"
#include "sovo/app/config_options.h"
#include "sovo/app/failure.h"
#include "sovo/app/frame_input.h"
#include "sovo/app/live_camera.h"
#include "sovo/app/progress.h"
#include "sovo/app/run_outputs.h"
#include "sovo/app/sim_input.h"
#include "sovo/app/stop_signal.h"
#include "sovo/app/vo_follower.h"
#include "sovo/bridge/camera_publisher.h"
#include "sovo/io/text.h"

namespace sovo::app {
namespace {

std::uint64_t random_session() {
  std::random_device device;
  return (std::uint64_t{device()} << 32) | device();
}

std::int64_t utc_now_ns() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
}

/// Frames on their way to the bus.
class Publication {
 public:
  Publication(FrameInput& input, bridge::CameraPublisher& publisher, VoFollower& follower,
              CalibrationReminder& calibration, StopSignal& stop)
      : input_(input),
        publisher_(publisher),
        follower_(follower),
        calibration_(calibration),
        stop_([&stop] { return stop.requested(); }) {}

  /// Publishes everything; returns an exit code. `paced`: wait for the odometry.
  int run(std::uint64_t session, bool paced) {
    wait_for_listeners();
    if (auto begun = input_.begin(); !begun) return fail(kFailed, begun.error());
    Progress progress(input_.source->size());
    while (!stop_()) {
      SourceResult next = input_.source->next(std::chrono::milliseconds(100));
      if (next.state == SourceState::kEndOfStream) break;
      if (next.state == SourceState::kFailed) return fail(kBadInput, next.message);
      if (next.state == SourceState::kBadFrame) spdlog::warn("frame left out: {}", next.message);
      if (next.state != SourceState::kFrame) continue;
      next.frame.session = session;
      if (paced) follower_.wait_before(next.frame.sequence, stop_);
      if (auto sent = publisher_.publish(next.frame); !sent) return fail(kFailed, sent.error());
      last_ = next.frame.sequence;
      progress.update(++published_, "");
    }
    // What is still on its way would be lost with this process.
    follower_.wait_for(last_, std::chrono::milliseconds(1000), stop_);
    spdlog::info("published {} frames", published_);
    return published_ > 0 ? kOk : fail(kFailed, "no frame could be published");
  }

 private:
  /// The first frames of a recording would go unheard while the processes find each other: waits
  /// for a listener, and for others that are about to be found; longer where no odometry is among
  /// them, for it may be one of those.
  void wait_for_listeners() {
    using Clock = std::chrono::steady_clock;
    constexpr std::chrono::seconds kPatience(5);
    constexpr std::chrono::milliseconds kSettled(300);
    constexpr std::chrono::milliseconds kSettledWithoutOdometry(2000);
    const auto begin = Clock::now();
    auto changed = begin;
    std::uint32_t listeners = 0;
    while (!stop_()) {
      const auto now = Clock::now();
      const std::uint32_t found = publisher_.num_readers();
      if (found != listeners) changed = now;
      listeners = found;
      if (!follower_.sees_odometry()) calibration_.remind();
      const auto settled = follower_.sees_odometry() ? kSettled : kSettledWithoutOdometry;
      if (listeners > 0 && now - changed > settled) return;
      if (listeners == 0 && now - begin > kPatience) {
        spdlog::warn("nobody listens after {} s; publishing all the same", kPatience.count());
        return;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }

  FrameInput& input_;
  bridge::CameraPublisher& publisher_;
  VoFollower& follower_;
  CalibrationReminder& calibration_;
  std::function<bool()> stop_;
  std::uint64_t last_ = 0;
  std::size_t published_ = 0;
};

/// Publishes what `open` gives, called when the signals are taken care of.
int publish(const AppConfig& config, const std::function<Result<FrameInput>()>& open) {
  StopSignal stop;  // before the threads of source and bus
  auto input = open();
  if (!input) return fail(kBadInput, input.error());
  auto participant = bridge::Participant::open(config.dds, "camera");
  if (!participant) return fail(kFailed, participant.error());
  for (const std::string& note : participant->notes()) spdlog::info("{}", note);

  StereoCameras cameras = input->cameras;
  if (!config.camera.name.empty()) cameras.rig.name = config.camera.name;
  const std::int64_t stamp_ns = utc_now_ns();
  auto publisher = bridge::CameraPublisher::open(*participant, cameras, stamp_ns);
  if (!publisher) return fail(kFailed, publisher.error());
  const std::uint64_t session = random_session();
  auto follower = VoFollower::open(*participant, session);
  if (!follower) return fail(kFailed, follower.error());
  CalibrationReminder reminder(config.dds.transport, *participant, *publisher, cameras, stamp_ns);
  return Publication(*input, *publisher, *follower, reminder, stop)
      .run(session, input->rate == 0.0);
}

int publish_dataset(const AppConfig& config) {
  if (config.camera.path.empty()) return fail(kUsage, "no dataset given; use --path FOLDER");
  return publish(config, [&config] { return open_dataset_input(config.camera, 1.0); });
}

/// What `camera sim` has beside the configuration.
struct SimArguments {
  std::string rate;
  std::string export_to;
  bool depth = false;
};

/// `--rate` of simulated cameras is the world's own clock: pairs a second, or as fast as can be.
Result<void> apply_rate(const std::string& rate, AppConfig* config) {
  if (rate.empty()) return {};
  if (rate == "max") {
    config->camera.rate = rate;
    return {};
  }
  const auto hertz = parse_double(rate);
  if (!hertz || !(*hertz > 0.0)) {
    return Error{"--rate is '" + rate + "'; it must be pairs a second [Hz], or max"};
  }
  config->sim.frame_rate = *hertz;
  return {};
}

int simulate(AppConfig config, const SimArguments& arguments) {
  if (auto applied = apply_rate(arguments.rate, &config); !applied) {
    return fail(kUsage, applied.error());
  }
  if (!arguments.export_to.empty()) return export_sim(config, arguments.export_to, arguments.depth);
  if (arguments.depth) return fail(kUsage, "--depth writes files: give their folder with --export");
  if (auto writable = check_outputs(config.output); !writable) {
    return fail(kUsage, writable.error());
  }
  return publish(config, [&config] { return open_sim_input(config, 1.0, false); });
}

void add_dataset_command(const Command& camera) {
  const Command command = camera.add_command("dataset", "Publish a recorded dataset");
  auto options = std::make_shared<ConfigOptions>(command);
  options->value("--path", "camera.path", "Folder of the dataset", "DIR")
      .flag("--restamp", "camera.restamp", "Shift the stamps so that the first frame is now")
      .value("--name", "camera.name", "Prefix of the camera's frame names", "NAME")
      .value("--rate", "camera.rate", "Speed: 1.0 is real time, max as fast as can be", "X|max");
  add_dataset_options(*options);
  add_dds_options(*options);
  command.action([options] {
    const auto config = options->load();
    return config ? publish_dataset(*config) : fail(kUsage, config.error());
  });
}

void add_sim_command(const Command& camera) {
  const Command command = camera.add_command("sim", "Publish, or export, a rendered world");
  auto options = std::make_shared<ConfigOptions>(command);
  auto arguments = std::make_shared<SimArguments>();
  add_sim_options(*options);
  options->value("--seed", "sim.seed", "Of the world and the noise", "N")
      .flag("--restamp", "camera.restamp", "Shift the stamps so that the first frame is now")
      .value("--name", "camera.name", "Prefix of the camera's frame names", "NAME");
  command
      .option("--rate", "Pairs a second, or max: as fast as the odometry takes them",
              &arguments->rate)
      .type("HZ|max");
  command
      .option("--export", "Write an EuRoC-layout folder instead; needs no bus",
              &arguments->export_to)
      .type("DIR");
  command.flag("--depth", "With --export: true depth of every left pixel", &arguments->depth);
  add_dataset_options(*options);
  add_dds_options(*options);
  command.action([options, arguments] {
    const auto config = options->load();
    return config ? simulate(*config, *arguments) : fail(kUsage, config.error());
  });
}

}  // namespace

void add_camera_command(const Command& program) {
  const Command camera = program.add_command("camera", "Publish stereo frames on the bus");
  camera.require_command();
  add_dataset_command(camera);
  add_sim_command(camera);
  add_live_camera_commands(camera);
}

}  // namespace sovo::app
