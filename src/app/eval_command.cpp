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

void add_options(CLI::App* command, EvalArguments* a) {
  command->add_option("--gt", a->files.truth, "True trajectory: TUM, KITTI or EuRoC, by content")
      ->required()
      ->type_name("FILE");
  command->add_option("--est", a->files.estimate, "Estimated trajectory, of the left camera")
      ->required()
      ->type_name("FILE");
  command
      ->add_option("--gt-calib", a->files.truth_calibration,
                   "Brings truth of the body to the left camera: EuRoC's cam0/sensor.yaml, a "
                   "Kalibr camchain, our calibration, or a dataset's folder")
      ->type_name("FILE");
  command
      ->add_option("--times", a->files.times,
                   "Times of KITTI poses; otherwise times.txt beside them or in "
                   "../sequences/NAME")
      ->type_name("FILE");
  command
      ->add_option("--lengths", a->options.lengths,
                   "Lengths of the pieces [m]; otherwise 100..800, 10..80 or 1..8 as the path "
                   "allows")
      ->delimiter(',')
      ->check(CLI::PositiveNumber);
  command->add_option("--step", a->options.step, "Every N-th frame starts a piece; 1 for clips")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command
      ->add_option("--tolerance", a->options.tolerance_s,
                   "Between stamps [s]; otherwise half the shorter period, at most 0.02")
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--frames", a->options.frames,
                   "Frames that were fed, for completion; otherwise those of the truth")
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--scale-length", a->options.scale_length,
                   "Displacement for the scale error [m]; otherwise 10 driving, 0.5 hand-held")
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--keyframes", a->files.keyframes,
                   "The run's --keyframes file: scale error from keyframe to keyframe")
      ->type_name("FILE.csv");
  command->add_option("--json", a->json, "Write all numbers")->type_name("FILE.json");
  command->add_option("--plot", a->plot, "Write trajectory and error plots")->type_name("FILE.svg");
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

void add_eval_command(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<EvalArguments>();
  CLI::App* command = app.add_subcommand("eval", "Measure a trajectory against the truth");
  command->footer(kExitCodesHelp);
  add_options(command, arguments.get());
  command->callback([arguments, exit_code] { *exit_code = evaluate_files(*arguments); });
}

}  // namespace sovo::app
