#include <filesystem>
#include <iostream>
#include <memory>

#include "sovo/app/commands.h"
#include "sovo/app/config_options.h"
#include "sovo/app/failure.h"
#include "sovo/app/report/dive_evaluation.h"
#include "sovo/app/report/dive_map.h"
#include "sovo/app/report/dive_summary.h"
#include "sovo/app/report/report_page.h"
#include "sovo/io/text.h"

namespace sovo::app {
namespace {

constexpr std::size_t kMostMapPoints = 20'000;

struct ReportArguments {
  std::string recording;
  std::string out = "report.html";
  std::string ns;
  EvaluationFiles files;
  EvaluationOptions options;
};

void add_options(const Command& command, ReportArguments* a) {
  command.option("recording", "Folder or .mcap file", &a->recording).required().type("DIR|FILE");
  command.option("-o,--out", "The page", &a->out).type("FILE.html").show_default();
  command.option("--ns", "Vehicle, where several were recorded", &a->ns).type("NAME");
  command.option("--gt", "True trajectory: TUM, KITTI or EuRoC, by content", &a->files.truth)
      .type("FILE");
  command
      .option("--gt-calib", "Brings truth of the body to the left camera, as for sovo eval",
              &a->files.truth_calibration)
      .type("FILE");
  command.option("--times", "Times of KITTI poses, as for sovo eval", &a->files.times).type("FILE");
  command.option("--step", "Every N-th frame starts a piece; 1 for clips", &a->options.step)
      .positive()
      .show_default();
}

int report(const ReportArguments& a, const AppConfig& config) {
  const auto dive = read_dive(a.recording, a.ns);
  if (!dive) return fail(kBadInput, dive.error());
  for (const std::string& note : dive->notes) spdlog::warn("{}", note);
  std::optional<DiveEvaluation> evaluation;
  if (!a.files.truth.empty()) {
    EvaluationOptions options = a.options;
    options.frames = summarize(*dive).sent;
    auto evaluated = evaluate_dive(*dive, a.files, options);
    if (!evaluated) return fail(kBadInput, evaluated.error());
    evaluation = std::move(*evaluated);
  }
  std::vector<std::vector<Vec3>> maps;
  for (const Dive& run : shown_runs(*dive)) {
    maps.push_back(map_points(run, config.odometry, kMostMapPoints));
  }
  const std::string page = format_report_page(*dive, evaluation, maps);
  if (auto written = write_text_file(a.out, page); !written) return fail(kFailed, written.error());
  std::cout << std::filesystem::absolute(a.out).lexically_normal().string() << std::endl;
  return kOk;
}

}  // namespace

void add_report_command(const Command& program) {
  const Command command = program.add_command("report", "A page about a recording, to keep");
  command.footer(kExitCodesHelp);
  auto arguments = std::make_shared<ReportArguments>();
  add_options(command, arguments.get());
  auto options = std::make_shared<ConfigOptions>(command);
  command.action([arguments, options] {
    const auto config = options->load();
    return config ? report(*arguments, *config) : fail(kUsage, config.error());
  });
}

}  // namespace sovo::app
