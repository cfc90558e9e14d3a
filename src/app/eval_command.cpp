#include <filesystem>
#include <iostream>
#include <memory>

#include "sovo/app/commands.h"
#include "sovo/app/failure.h"
#include "sovo/eval/evaluation.h"
#include "sovo/io/text.h"

namespace sovo::app {
namespace {

struct EvalArguments {
  EvaluationFiles files;
  EvaluationOptions options;
  std::string json;
  std::string plot;
};

void add_options(const Command& command, EvalArguments* a) {
  command.option("--gt", "True trajectory: TUM, KITTI or EuRoC, by content", &a->files.truth)
      .required()
      .type("FILE");
  command.option("--est", "Estimated trajectory, of the left camera", &a->files.estimate)
      .required()
      .type("FILE");
  command
      .option("--gt-calib",
              "Brings truth of the body to the left camera: EuRoC's cam0/sensor.yaml, a Kalibr "
              "camchain, our calibration, or a dataset's folder",
              &a->files.truth_calibration)
      .type("FILE");
  command
      .option("--times",
              "Times of KITTI poses; otherwise times.txt beside them or in ../sequences/NAME",
              &a->files.times)
      .type("FILE");
  command
      .option("--lengths",
              "Lengths of the pieces [m]; otherwise 100..800, 10..80 or 1..8 as the path allows",
              &a->options.lengths)
      .comma_separated()
      .positive();
  command.option("--step", "Every N-th frame starts a piece; 1 for clips", &a->options.step)
      .positive()
      .show_default();
  command
      .option("--tolerance", "Between stamps [s]; otherwise half the shorter period, at most 0.02",
              &a->options.tolerance_s)
      .positive();
  command
      .option("--frames", "Frames that were fed, for completion; otherwise those of the truth",
              &a->options.frames)
      .positive();
  command
      .option("--scale-length",
              "Displacement for the scale error [m]; otherwise 10 driving, 0.5 hand-held",
              &a->options.scale_length)
      .positive();
  command
      .option("--keyframes", "The run's --keyframes file: scale error from keyframe to keyframe",
              &a->files.keyframes)
      .type("FILE.csv");
  command.option("--json", "Write all numbers", &a->json).type("FILE.json");
  command.option("--plot", "Write trajectory and error plots", &a->plot).type("FILE.svg");
}

/// "est.txt against groundtruth.txt": the folders would not fit.
std::string plot_title(const EvaluationFiles& files) {
  return std::filesystem::path(files.estimate).filename().string() + " against " +
         std::filesystem::path(files.truth).filename().string();
}

int evaluate_files(const EvalArguments& a) {
  const auto input = read_evaluation_input(a.files);
  if (!input) return fail(kBadInput, input.error());
  const auto report = evaluate(*input, a.options);
  if (!report) return fail(kBadInput, report.error());
  std::cout << format_table(*report) << std::flush;
  if (!a.json.empty()) {
    const auto written = write_text_file(a.json, format_json(*report));
    if (!written) return fail(kFailed, written.error());
  }
  if (!a.plot.empty()) {
    const auto written = write_text_file(a.plot, format_svg(*report, plot_title(a.files)));
    if (!written) return fail(kFailed, written.error());
  }
  return kOk;
}

}  // namespace

void add_eval_command(const Command& program) {
  auto arguments = std::make_shared<EvalArguments>();
  const Command command = program.add_command("eval", "Measure a trajectory against the truth");
  command.footer(kExitCodesHelp);
  add_options(command, arguments.get());
  command.action([arguments] { return evaluate_files(*arguments); });
}

}  // namespace sovo::app
