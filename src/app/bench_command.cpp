#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "sovo/app/commands.h"
#include "sovo/app/config_options.h"
#include "sovo/app/failure.h"
#include "sovo/app/progress.h"
#include "sovo/app/stop_signal.h"
#include "sovo/app/synthetic_bench.h"
#include "sovo/eval/statistics.h"
#include "sovo/io/text.h"

namespace sovo::app {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

struct BenchArguments {
  std::string only;  ///< Part of the names of the cases wanted.
  int runs = 1;
  std::string json;
};

/// A column of the table: what it shows of a run, and which of several runs is the worst.
struct Column {
  const char* title;
  const char* key;  ///< In the JSON file, where the value is not scaled.
  double SyntheticResult::*value;
  double scale;
  int digits;
  bool more_is_better;
};

const std::vector<Column>& columns() {
  static const std::vector<Column> kColumns = {
      {"complete %", "completion", &SyntheticResult::completion, 100.0, 1, true},
      {"t_rel %", "t_rel", &SyntheticResult::t_rel, 100.0, 3, false},
      {"r deg/100m", "r_rel_rad_per_m", &SyntheticResult::r_rel, 100.0 * kDegrees, 3, false},
      {"ATE m", "ate_m", &SyntheticResult::ate_m, 1.0, 4, false},
      {"scale %", "scale_median", &SyntheticResult::scale_median, 100.0, 3, false},
      {"p95 %", "scale_p95", &SyntheticResult::scale_p95, 100.0, 3, false},
      {"NEES", "scale_nees", &SyntheticResult::scale_nees, 1.0, 2, false},
      {"NEES 1 s", "pose_nees_1s", &SyntheticResult::pose_nees_1s, 1.0, 2, false},
      {"NEES 10 m", "pose_nees_10m", &SyntheticResult::pose_nees_10m, 1.0, 2, false},
      {"kf/frame", "keyframes_per_frame", &SyntheticResult::keyframes_per_frame, 1.0, 2, false},
      {"ms/frame", "frame_ms", &SyntheticResult::frame_ms, 1.0, 1, false},
  };
  return kColumns;
}

std::string padded(const std::string& text, std::size_t width) {
  return std::string(width - std::min(width, text.size()), ' ') + text;
}

std::string name_cell(const std::string& name) {
  constexpr std::size_t kWidth = 20;
  return name + std::string(kWidth - std::min(kWidth, name.size()), ' ');
}

std::string table_head() {
  std::string text = name_cell("world/trajectory") + padded("m", 6) + padded("frames", 8);
  for (const Column& column : columns()) text += padded(column.title, 12);
  return text + "\n";
}

/// What a column shows of each run.
std::vector<double> shown(const Column& column, const std::vector<SyntheticResult>& runs) {
  std::vector<double> values;
  values.reserve(runs.size());
  for (const SyntheticResult& run : runs) values.push_back(column.scale * run.*column.value);
  return values;
}

/// The median of each column over the runs; with several runs the worst in brackets.
std::string table_row(const SyntheticCase& which, const std::vector<SyntheticResult>& runs) {
  std::string text = name_cell(name_of(which)) + padded(format_fixed(runs[0].length_m, 0), 6) +
                     padded(std::to_string(runs[0].frames), 8);
  for (const Column& column : columns()) {
    const std::vector<double> values = shown(column, runs);
    std::string cell = format_fixed(quantile(values, 0.5), column.digits);
    if (runs.size() > 1) {
      const auto [least, most] = std::minmax_element(values.begin(), values.end());
      cell += "(" + format_fixed(column.more_is_better ? *least : *most, column.digits) + ")";
    }
    text += padded(cell, 12 + (runs.size() > 1 ? 4 : 0));
  }
  return text + "\n";
}

/// The mean of the cases' medians, which is the benchmark's word on what differs from flight to
/// flight.
std::string mean_row(const std::vector<std::vector<SyntheticResult>>& cases) {
  double length = 0.0;
  std::size_t frames = 0;
  for (const auto& runs : cases) {
    length += runs[0].length_m;
    frames += runs[0].frames;
  }
  std::string text = name_cell("all, mean") + padded(format_fixed(length, 0), 6) +
                     padded(std::to_string(frames), 8);
  for (const Column& column : columns()) {
    double sum = 0.0;
    for (const auto& runs : cases) sum += quantile(shown(column, runs), 0.5);
    const double mean = sum / static_cast<double>(cases.size());
    text += padded(format_fixed(mean, column.digits), 12 + (cases[0].size() > 1 ? 4 : 0));
  }
  return text + "\n";
}

nlohmann::ordered_json case_to_json(const SyntheticCase& which, std::uint64_t seed,
                                    const SyntheticResult& run) {
  nlohmann::ordered_json json;
  json["case"] = name_of(which);
  json["seed"] = seed;
  json["length_m"] = run.length_m;
  json["frames"] = run.frames;
  for (const Column& column : columns()) json[column.key] = run.*column.value;
  return json;
}

std::vector<SyntheticCase> chosen_cases(const std::string& only) {
  std::vector<SyntheticCase> cases = all_synthetic_cases();
  const auto unwanted = [&only](const SyntheticCase& c) {
    return name_of(c).find(only) == std::string::npos;
  };
  cases.erase(std::remove_if(cases.begin(), cases.end(), unwanted), cases.end());
  return cases;
}

/// All runs of one case; complaints are logged.
std::vector<SyntheticResult> run_case(const AppConfig& config, const SyntheticCase& which,
                                      const BenchArguments& arguments, StopSignal& stop,
                                      nlohmann::ordered_json* json) {
  std::vector<SyntheticResult> runs;
  for (int i = 0; i < arguments.runs; ++i) {
    const std::uint64_t seed = config.sim.seed + static_cast<std::uint64_t>(i);
    std::unique_ptr<Progress> progress;
    const auto result =
        run_synthetic(config, which, seed, [&](std::size_t done, std::size_t total) {
          if (!progress) progress = std::make_unique<Progress>(total);
          progress->update(done, name_of(which));
          return !stop.requested();
        });
    progress.reset();
    if (!result) {
      spdlog::error("{}: {}", name_of(which), result.error());
      return {};
    }
    runs.push_back(*result);
    json->push_back(case_to_json(which, seed, *result));
  }
  return runs;
}

int bench_synthetic(const AppConfig& config, const BenchArguments& arguments) {
  const auto cases = chosen_cases(arguments.only);
  if (cases.empty()) {
    std::string names;
    for (const SyntheticCase& c : all_synthetic_cases()) names += "\n  " + name_of(c);
    return fail(kUsage, "no case has '" + arguments.only + "' in its name; there are:" + names);
  }
  StopSignal stop;
  std::cout << "Synthetic: rendered worlds, exact truth; '<' is flown backwards"
            << (arguments.runs > 1 ? "; medians, worst in brackets\n" : "\n") << table_head()
            << std::flush;
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  std::vector<std::vector<SyntheticResult>> flown;
  for (const SyntheticCase& which : cases) {
    const auto runs = run_case(config, which, arguments, stop, &json);
    if (stop.requested()) return fail(kFailed, "stopped by the user");
    if (runs.empty()) continue;
    std::cout << table_row(which, runs) << std::flush;
    flown.push_back(runs);
  }
  if (flown.size() > 1) std::cout << mean_row(flown);
  if (!arguments.json.empty()) {
    const auto written = write_text_file(arguments.json, json.dump(2) + "\n");
    if (!written) return fail(kFailed, written.error());
  }
  return flown.size() == cases.size() ? kOk : kFailed;
}

}  // namespace

void add_bench_command(const Command& program) {
  const Command bench = program.add_command("bench", "Tables of accuracy and speed");
  bench.require_command();
  const Command command = bench.add_command(
      "synthetic", "Fly the odometry through the simulated worlds, forward and backward");
  auto arguments = std::make_shared<BenchArguments>();
  command
      .option("--only", "Only cases with this in their name: street, hall/race, <",
              &arguments->only)
      .type("TEXT");
  command.option("--runs", "Runs a case, each with another seed", &arguments->runs)
      .in_range(1, 1000);
  command.option("--json", "Write all numbers", &arguments->json).type("FILE.json");
  auto options = std::make_shared<ConfigOptions>(command);
  options->value("--seed", "sim.seed", "Of the first run: world, noise and odometry", "N")
      .value("--calib", "camera.calibration", "Cameras to render with, not the world's", "FILE")
      .value("--frames", "camera.frames", "Frames at most", "N")
      .value("--mode", "mode", "Who owns the metric scale", "mono|scale|stereo")
      .value("--preset", "preset", "Values to begin with", "embedded|default|quality")
      .value("--threads", "threads", "Of the loops inside the stages", "N");
  command.action([options, arguments] {
    const auto config = options->load();
    return config ? bench_synthetic(*config, *arguments) : fail(kUsage, config.error());
  });
}

}  // namespace sovo::app
