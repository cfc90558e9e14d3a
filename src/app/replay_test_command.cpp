#include <filesystem>
#include <iostream>
#include <memory>
#include <string>

#include "sovo/app/commands.h"
#include "sovo/app/config_options.h"
#include "sovo/app/failure.h"
#include "sovo/app/golden.h"
#include "sovo/app/mcap_input.h"
#include "sovo/app/odometry_session.h"
#include "sovo/app/stop_signal.h"
#include "sovo/io/text.h"

namespace sovo::app {
namespace {

struct GoldenArguments {
  std::string file;
  bool update = false;
};

/// Runs the odometry over the recording, all stages in order.
Result<Golden> run_recording(AppConfig config) {
  config.odometry.deterministic = true;
  config.odometry.wait_for_mapping = true;
  StopSignal stop;  // before the threads of source and odometry
  auto input = open_mcap_input(config);
  if (!input) return input.failure();
  GoldenRecorder recorder;
  StereoOdometry odometry(config.odometry, input->cameras, &recorder, nullptr);
  while (!stop.requested()) {
    const SourceResult next = input->source->next(std::chrono::milliseconds(100));
    if (next.state == SourceState::kFrame) odometry.process(next.frame);
    if (next.state == SourceState::kBadFrame) return Error{next.message};
    if (next.state == SourceState::kEndOfStream) {
      odometry.finish();
      Golden golden;
      golden.frames = recorder.frames();
      return golden;
    }
  }
  return Error{"stopped by the user"};
}

int update(const Golden& actual, const GoldenTolerances& tolerances, const std::string& path) {
  Golden golden = actual;
  golden.tolerances = tolerances;
  const auto written = write_text_file(path, to_json(golden));
  if (!written) return fail(kFailed, written.error());
  std::cout << path << ": " << golden.frames.size() << " frames written\n";
  return kOk;
}

int replay_test(const AppConfig& config, const GoldenArguments& arguments) {
  if (config.camera.mcap.empty() || arguments.file.empty()) {
    return fail(kUsage,
                "name a recording and its golden file: sovo replay-test DIVE --golden FILE");
  }
  std::optional<Golden> expected;
  if (std::filesystem::exists(arguments.file)) {
    const auto text = read_text_file(arguments.file);
    if (!text) return fail(kBadInput, text.error());
    auto golden = parse_golden(*text, arguments.file);
    if (!golden && !arguments.update) return fail(kBadInput, golden.error());
    if (golden) expected = std::move(*golden);
  } else if (!arguments.update) {
    return fail(kBadInput, arguments.file + " does not exist; write it with --update");
  }
  const auto actual = run_recording(config);
  if (!actual) return fail(kBadInput, actual.error());
  if (arguments.update) {
    return update(*actual, expected ? expected->tolerances : GoldenTolerances{}, arguments.file);
  }
  if (expected->kernels != actual->kernels) {
    spdlog::warn("{} was made with kernels '{}', this run has '{}'", arguments.file,
                 expected->kernels, actual->kernels);
  }
  if (const auto different = first_difference(*expected, *actual)) {
    return fail(kFailed, *different);
  }
  const GoldenTolerances off = largest_differences(*expected, *actual);
  std::cout << fmt::format(
      "{} frames agree: position within {:.2e} m (allowed {}), rotation {:.2e} rad ({}), "
      "log-scale {:.2e} ({})\n",
      actual->frames.size(), off.position_m, expected->tolerances.position_m, off.rotation_rad,
      expected->tolerances.rotation_rad, off.log_scale, expected->tolerances.log_scale);
  return kOk;
}

}  // namespace

void add_replay_test_command(const Command& program) {
  const Command command =
      program.add_command("replay-test", "Compare a run over a recording with a golden file");
  auto options = std::make_shared<ConfigOptions>(command);
  auto arguments = std::make_shared<GoldenArguments>();
  options->value("recording", "camera.mcap", "Folder or .mcap file", "DIR|FILE")
      .value("--calib", "camera.calibration", "Calibration file, instead of the recorded one",
             "FILE")
      .value("--left", "node.left", "Image topic of the left camera", "TOPIC")
      .value("--right", "node.right", "That of the right camera", "TOPIC")
      .value("--mode", "mode", "Who owns the metric scale", "mono|scale|stereo")
      .value("--seed", "seed", "Of every random choice", "N");
  command.option("--golden", "Golden file to compare with", &arguments->file).type("FILE.json");
  command.flag("--update", "Write the golden file anew; its tolerances stay", &arguments->update);
  command.action([options, arguments] {
    const auto config = options->load();
    return config ? replay_test(*config, *arguments) : fail(kUsage, config.error());
  });
}

}  // namespace sovo::app
