#include <spdlog/spdlog.h>

#include <memory>
#include <string>

#include "sovo/app/commands.h"
#include "sovo/app/config_options.h"
#include "sovo/app/dataset_input.h"
#include "sovo/app/failure.h"
#include "sovo/app/odometry_session.h"
#include "sovo/app/progress.h"
#include "sovo/app/stop_signal.h"

namespace sovo::app {
namespace {

/// Feeds every frame until the source ends or the user stops; false when the source broke.
bool feed(DatasetSource& source, OdometrySession& session, StopSignal& stop) {
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

int run(AppConfig config) {
  if (config.camera.path.empty()) return fail(kUsage, "no dataset given; use --dataset FOLDER");
  if (auto writable = check_outputs(config.output); !writable) {
    return fail(kUsage, writable.error());
  }
  StopSignal stop;  // before the threads of source and odometry
  auto source = open_dataset_input(config.camera, 0.0);
  if (!source) return fail(kBadInput, source.error());
  DatasetSource& dataset = **source;
  // As fast as can be means that the source waits for the odometry and nothing is dropped.
  if (*parse_rate(config.camera.rate, 0.0) == 0.0) config.odometry.wait_for_mapping = true;
  OdometrySession session(config, to_cameras(dataset.calibration()));
  const bool source_ok = feed(dataset, session, stop);
  const int code =
      session.finish([&dataset](std::int64_t fed) { return dataset.original_stamp(fed); });
  return source_ok ? code : kBadInput;
}

}  // namespace

void add_run_command(CLI::App& app, int* exit_code) {
  CLI::App* command = app.add_subcommand("run", "Run the odometry on a dataset, in one process");
  auto options = std::make_shared<ConfigOptions>(command);
  options->value("--dataset", "camera.path", "Folder of the dataset", "DIR");
  add_dataset_options(*options);
  add_odometry_options(*options);
  command->callback([options, exit_code] {
    const auto config = options->load();
    *exit_code = config ? run(*config) : fail(kUsage, config.error());
  });
}

}  // namespace sovo::app
