#include <chrono>
#include <cstdint>
#include <memory>
#include <random>
#include <thread>

#include "sovo/app/commands.h"
#include "sovo/app/config_options.h"
#include "sovo/app/dataset_input.h"
#include "sovo/app/failure.h"
#include "sovo/app/progress.h"
#include "sovo/app/stop_signal.h"
#include "sovo/app/vo_follower.h"
#include "sovo/bridge/camera_publisher.h"

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

/// A dataset on its way to the bus.
class DatasetPublication {
 public:
  DatasetPublication(DatasetSource& source, bridge::CameraPublisher& publisher,
                     VoFollower& follower, StopSignal& stop)
      : source_(source),
        publisher_(publisher),
        follower_(follower),
        stop_([&stop] { return stop.requested(); }) {}

  /// Publishes everything; returns an exit code. `paced`: wait for the odometry.
  int run(std::uint64_t session, bool paced) {
    wait_for_listener();
    Progress progress(source_.size());
    while (!stop_()) {
      SourceResult next = source_.next(std::chrono::milliseconds(100));
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
  /// The first frames of a recording would go unheard while the processes find each other.
  void wait_for_listener() {
    constexpr std::chrono::seconds kPatience(5);
    const auto begin = std::chrono::steady_clock::now();
    while (publisher_.num_readers() == 0 && !stop_()) {
      if (std::chrono::steady_clock::now() - begin > kPatience) {
        spdlog::warn("nobody listens after {} s; publishing all the same", kPatience.count());
        return;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }

  DatasetSource& source_;
  bridge::CameraPublisher& publisher_;
  VoFollower& follower_;
  std::function<bool()> stop_;
  std::uint64_t last_ = 0;
  std::size_t published_ = 0;
};

int publish_dataset(const AppConfig& config) {
  if (config.camera.path.empty()) return fail(kUsage, "no dataset given; use --path FOLDER");
  StopSignal stop;  // before the threads of source and bus
  auto source = open_dataset_input(config.camera, 1.0);
  if (!source) return fail(kBadInput, source.error());
  auto participant = bridge::Participant::open(config.dds, "camera");
  if (!participant) return fail(kFailed, participant.error());
  for (const std::string& note : participant->notes()) spdlog::info("{}", note);

  StereoCameras cameras = to_cameras((*source)->calibration());
  if (!config.camera.name.empty()) cameras.rig.name = config.camera.name;
  auto publisher = bridge::CameraPublisher::open(*participant, cameras, utc_now_ns());
  if (!publisher) return fail(kFailed, publisher.error());
  const std::uint64_t session = random_session();
  auto follower = VoFollower::open(*participant, session);
  if (!follower) return fail(kFailed, follower.error());
  const bool paced = *parse_rate(config.camera.rate, 1.0) == 0.0;
  return DatasetPublication(**source, *publisher, *follower, stop).run(session, paced);
}

}  // namespace

void add_camera_command(CLI::App& app, int* exit_code) {
  CLI::App* camera = app.add_subcommand("camera", "Publish stereo frames on the bus");
  camera->require_subcommand(1);
  CLI::App* dataset = camera->add_subcommand("dataset", "Publish a recorded dataset");
  auto options = std::make_shared<ConfigOptions>(dataset);
  options->value("--path", "camera.path", "Folder of the dataset", "DIR")
      .flag("--restamp", "camera.restamp", "Shift the stamps so that the first frame is now")
      .value("--name", "camera.name", "Prefix of the camera's frame names", "NAME");
  add_dataset_options(*options);
  add_dds_options(*options);
  dataset->callback([options, exit_code] {
    const auto config = options->load();
    *exit_code = config ? publish_dataset(*config) : fail(kUsage, config.error());
  });
}

}  // namespace sovo::app
