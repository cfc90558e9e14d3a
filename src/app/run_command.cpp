#include <spdlog/spdlog.h>

#include <memory>
#include <string>

#include "sovo/app/commands.h"
#include "sovo/app/config_options.h"
#include "sovo/app/failure.h"
#include "sovo/app/frame_input.h"
#include "sovo/app/mcap_input.h"
#include "sovo/app/odometry_session.h"
#include "sovo/app/progress.h"
#include "sovo/app/stop_signal.h"

namespace sovo::app {
namespace {

/// Feeds every frame until the source ends or the user stops; false when the source broke.
bool feed(FrameSource& source, OdometrySession& session, StopSignal& stop) {
  Progress progress(source.size());
  while (!stop.requested()) {
    const SourceResult next = source.next(std::chrono::milliseconds(100));
    switch (next.state) {
      case SourceState::kFrame: {
        session.process(next.frame);
        const RunCounts counts = session.counts();
        progress.update(counts.fed, counts.state);
        break;
      }
      case SourceState::kTimeout:
        break;
      case SourceState::kBadFrame:
        spdlog::warn("frame left out: {}", next.message);
        break;
      case SourceState::kFailed:
        spdlog::error("{}", next.message);
        return false;
      case SourceState::kEndOfStream:
        return true;
    }
  }
  spdlog::info("stopped by the user");
  return true;
}

int run_odometry(AppConfig config, bool simulated) {
  const bool recorded = !simulated && !config.camera.mcap.empty();
  if (!simulated && !recorded && config.camera.path.empty()) {
    return fail(kUsage,
                "no source given; use --dataset FOLDER, --mcap RECORDING, or --world NAME for a "
                "simulated one");
  }
  if (simulated && !config.camera.path.empty()) {
    return fail(kUsage, "two sources given: --dataset (camera.path) and --world; leave one out");
  }
  if (auto writable = check_outputs(config.output); !writable) {
    return fail(kUsage, writable.error());
  }
  StopSignal stop;  // before the threads of source and odometry
  auto input = simulated  ? open_sim_input(config, 0.0, true)
               : recorded ? open_mcap_input(config)
                          : open_dataset_input(config.camera, 0.0);
  if (!input) return fail(kBadInput, input.error());
  // As fast as can be means that the source waits for the odometry and nothing is dropped.
  if (input->rate == 0.0) config.odometry.wait_for_mapping = true;
  OdometrySession session(config, input->cameras);
  if (auto begun = input->begin(); !begun) return fail(kFailed, begun.error());
  const bool source_ok = feed(*input->source, session, stop);
  const int code = session.finish(input->original_stamp);
  return source_ok ? code : kBadInput;
}

}  // namespace

void add_run_command(const Command& program) {
  const Command command = program.add_command(
      "run", "Run the odometry on a dataset, recording or simulated world, in one process");
  auto options = std::make_shared<ConfigOptions>(command);
  options->value("--dataset", "camera.path", "Folder of the dataset", "DIR")
      .value("--mcap", "camera.mcap", "Recording: an .mcap file or a folder", "FILE|DIR")
      .value("--left", "node.left", "With --mcap: image topic of the left camera", "TOPIC")
      .value("--right", "node.right", "With --mcap: that of the right camera", "TOPIC")
      .value("--rate", "camera.rate", "Speed: 1.0 is real time, max as fast as can be", "X|max");
  add_sim_options(*options);
  add_dataset_options(*options);
  add_odometry_options(*options);
  command.action([options] {
    const auto config = options->load();
    return config ? run_odometry(*config, options->is_given("--world"))
                  : fail(kUsage, config.error());
  });
}

}  // namespace sovo::app
