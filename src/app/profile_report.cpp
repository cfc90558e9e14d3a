#include "sovo/app/profile_report.h"

#include <spdlog/fmt/fmt.h>

#include <nlohmann/json.hpp>

#include "sovo/app/process_memory.h"

namespace sovo::app {
namespace {

double keyframes_per_frame(const RunCounts& counts) {
  return counts.fed == 0 ? 0.0
                         : static_cast<double>(counts.keyframes) / static_cast<double>(counts.fed);
}

/// Counts and what they are of, by name.
std::string counted(const std::map<std::string, std::uint64_t>& counts) {
  std::string text;
  for (const auto& [name, count] : counts) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, name);
  }
  return text.empty() ? "none" : text;
}

}  // namespace

std::string timing_table(const ProfileCollector& profile) {
  std::string table = fmt::format("{:<20}{:>8}{:>10}{:>10}{:>10}{:>10}\n", "stage [ms]", "count",
                                  "mean", "median", "p95", "max");
  for (const StageSummary& s : profile.stages()) {
    if (s.count == 0) continue;
    table += fmt::format("{:<20}{:>8}{:>10.3f}{:>10.3f}{:>10.3f}{:>10.3f}\n", s.name, s.count,
                         s.mean_ms, s.median_ms, s.p95_ms, s.max_ms);
  }
  return table;
}

std::string profile_json(const ProfileCollector& profile, const RunCounts& counts,
                         const ProfileContext& context) {
  nlohmann::ordered_json json;
  for (const StageSummary& s : profile.stages()) {
    json["stages"][s.name] = {{"count", s.count},
                              {"mean_ms", s.mean_ms},
                              {"median_ms", s.median_ms},
                              {"p95_ms", s.p95_ms}};
  }
  const WorkCounters work = profile.counters();
  json["counters"] = {{"points", work.points},
                      {"residuals", work.residuals},
                      {"keyframes", counts.keyframes},
                      {"frames", counts.fed},
                      {"keyframes_per_frame", keyframes_per_frame(counts)}};
  json["peak_memory_mb"] = peak_memory_mb();
  json["threads"] = context.threads;
  json["kernels"] = context.kernels;
  return json.dump(2) + "\n";
}

std::string run_summary(const ProfileCollector& profile, const RunCounts& counts,
                        const std::optional<LoopCounts>& loops) {
  const WorkCounters work = profile.counters();
  double frame_ms = 0.0;
  for (const StageSummary& s : profile.stages()) {
    if (s.name == to_string(Stage::kFrame)) frame_ms = s.mean_ms;
  }
  std::string text;
  text += fmt::format("frames fed       {}\n", counts.fed);
  text +=
      fmt::format("frames tracked   {} ({:.1f} %)\n", counts.tracked, 100.0 * counts.completion());
  text += fmt::format("states           {}\n", counted(counts.states));
  text += fmt::format("frames refused   {}, dropped {}\n", counts.rejected, counts.dropped);
  text += fmt::format("keyframes        {} ({:.3f} a frame; {:.0f} points, {:.0f} residuals)\n",
                      counts.keyframes, keyframes_per_frame(counts), work.points, work.residuals);
  text += fmt::format("new segments     {}\n", counts.new_segments);
  if (loops) {
    text += fmt::format("loops closed     {} (places {}, views matched {}, impossible {})\n",
                        loops->closures, loops->places, loops->matched, loops->refused);
  }
  if (counts.corner_light < 1.0) {
    text +=
        fmt::format("light in corners {:.2f} (the vignette that was found)\n", counts.corner_light);
  }
  text += fmt::format("time a frame     {:.2f} ms\n", frame_ms);
  text += fmt::format("scale verdicts   {}\n", counted(counts.verdicts));
  text += fmt::format("peak memory      {:.1f} MB\n", peak_memory_mb());
  return text;
}

}  // namespace sovo::app
