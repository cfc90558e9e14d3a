#include "sovo/app/report/report_page.h"

#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <numbers>

#include "sovo/app/report/dive_runs.h"
#include "sovo/app/report/dive_summary.h"
#include "sovo/app/report/health_timeline.h"
#include "sovo/app/report/html.h"
#include "sovo/app/report/report_charts.h"
#include "sovo/app/report/report_style.h"
#include "sovo/io/text.h"

namespace sovo::app {
namespace {

constexpr double kChartWidth = 580.0;  // [px], of the drawing; the page scales it
constexpr double kChartHeight = 270.0;
constexpr double kMapHeight = 480.0;
constexpr std::size_t kMostRows = 500;
constexpr std::size_t kMostRuns = 5;

/// How a policy names a style: base64 of its SHA-256.
std::string style_hash(const std::string& style) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  EVP_Digest(style.data(), style.size(), digest.data(), &size, EVP_sha256(), nullptr);
  std::array<unsigned char, 4 * (EVP_MAX_MD_SIZE / 3 + 1) + 1> text{};
  const int length = EVP_EncodeBlock(text.data(), digest.data(), static_cast<int>(size));
  return {text.begin(), text.begin() + length};
}

std::string utc_text(std::uint64_t ns) {
  const auto seconds = static_cast<std::time_t>(ns / 1'000'000'000);
  std::tm utc{};
  std::array<char, 40> text{};
  if (gmtime_r(&seconds, &utc) == nullptr) return "unknown";
  const auto size = std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M:%S UTC", &utc);
  return {text.data(), size};
}

std::string percent_of(double part, double whole) {
  return whole > 0.0 ? format_fixed(100.0 * part / whole, 1) + " %" : "-";
}

std::string ms(double seconds) { return format_fixed(1e3 * seconds, 1) + " ms"; }

std::string tile(const std::string& id, const std::string& name, const std::string& value) {
  return "<div><dt>" + escape_html(name) + "</dt><dd id=\"" + id + "\">" + escape_html(value) +
         "</dd></div>\n";
}

std::string format_head(const Dive& dive) {
  const std::string title = "Report of " + dive.path.substr(dive.path.find_last_of('/') + 1);
  return "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
         "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
         "'sha256-" +
         style_hash(kReportStyle) +
         "'; base-uri 'none'; form-action 'none'\">\n"
         "<meta name=\"viewport\" content=\"width=device-width\">\n<title>" +
         escape_html(title) + "</title>\n<style>" + kReportStyle + "</style></head><body>\n<h1>" +
         escape_html(title) + "</h1>\n<p>" + escape_html(dive.vehicle) + ", recorded from " +
         utc_text(dive.start_ns) + " on, " + format_fixed(dive.duration_s(), 1) +
         " s. Times below count from there.</p>\n";
}

std::string format_tiles(const DiveSummary& s, const std::vector<HealthPeriod>& periods) {
  const auto seconds = [&](std::uint8_t state) {
    return format_fixed(time_in(periods, state), 1) + " s";
  };
  double all = 0.0;
  for (const HealthPeriod& period : periods) all += period.duration_s();
  return "<dl class=\"tiles\">\n" +
         tile("distance", "Distance", format_fixed(s.distance_m, 2) + " m") +
         tile("frames", "Frames tracked with scale",
              std::to_string(s.metric_poses) + " of " + std::to_string(s.sent)) +
         tile("tracking", "Time tracking", percent_of(time_in(periods, 1), all)) +
         tile("unobserved", "Scale not observed", seconds(2)) +
         tile("degraded", "Degraded", seconds(3)) + tile("lost", "Lost", seconds(4)) +
         tile("silent", "Silent", seconds(kSilent)) +
         tile("lost_transport", "Frames lost on the way", std::to_string(s.lost_transport)) +
         tile("dropped", "Dropped by the odometry", std::to_string(s.dropped_queue)) +
         tile("rejected", "Refused", std::to_string(s.rejected)) +
         tile("rate", "Rate, median", format_fixed(s.rate_hz, 1) + " /s") +
         tile("latency", "Latency, median", ms(s.latency_median_s)) +
         tile("latency_p95", "Latency, 95 %", ms(s.latency_p95_s)) +
         tile("latency_max", "Latency, largest", ms(s.latency_max_s)) +
         tile("keyframes", "Keyframes", std::to_string(s.keyframes)) +
         tile("segments", "Segments", std::to_string(s.segments)) +
         tile("sigma", "Scale, 2 sigma at the end", format_fixed(200.0 * s.last_sigma, 2) + " %") +
         "</dl>\n";
}

std::string figure(const std::string& svg) { return "<figure>" + svg + "</figure>\n"; }

/// ", run 2 of 3" where there are several.
std::string run_name(const Dive& run, std::size_t runs) {
  if (runs <= 1 || run.poses.empty()) return "";
  const auto seconds = [&](const DivePose& pose) {
    return format_fixed(run.seconds(pose.log_ns), 1) + " s";
  };
  return ", run " + std::to_string(run.poses.front().run + 1) + " of " + std::to_string(runs) +
         ", " + seconds(run.poses.front()) + " to " + seconds(run.poses.back());
}

std::string format_runs(std::size_t runs, std::size_t shown) {
  if (runs <= 1) return "";
  return "<p id=\"runs\">The odometry was started " + std::to_string(runs) +
         " times. Each run has an odom of its own, so each is drawn by itself" +
         (shown < runs ? "; those " + std::to_string(shown) + " with the most poses are" : "") +
         ".</p>\n";
}

std::string format_trajectory(const Dive& dive, const std::vector<Vec3>& truth, std::size_t runs) {
  const bool any = std::any_of(dive.poses.begin(), dive.poses.end(),
                               [](const DivePose& pose) { return pose.metric; });
  if (!any) {
    return "<h2>Trajectory</h2>\n<p>No pose with a known scale was recorded.</p>\n";
  }
  return "<h2>Trajectory of base_link in odom" + run_name(dive, runs) +
         "</h2>\n<div class=\"charts\">" +
         figure(format_chart(chart_from_above(dive, truth), kChartWidth, kMapHeight)) +
         figure(format_chart(chart_from_side(dive, truth), kChartWidth, kMapHeight)) + "</div>\n";
}

std::string format_map(const Dive& dive, const std::vector<Vec3>& map, std::size_t runs) {
  if (map.empty()) {
    return std::string("<h2>Map</h2>\n<p>No map: ") +
           (dive.cameras ? "no keyframe with points was recorded."
                         : "the calibration was not recorded.") +
           "</p>\n";
  }
  return "<h2>Map" + run_name(dive, runs) + "</h2>\n" +
         figure(format_chart(chart_of_map(dive, map), 2.0 * kChartWidth, 1.4 * kMapHeight)) +
         "<p>" + std::to_string(map.size()) + " points of " +
         std::to_string(dive.keyframes.size()) + " keyframes.</p>\n";
}

/// What a table leaves out, in words.
std::string rest_of(std::size_t all) {
  if (all <= kMostRows) return "";
  return "<p>and " + std::to_string(all - kMostRows) + " more.</p>\n";
}

std::string format_legend() {
  std::string out = "<svg viewBox=\"0 0 1160 20\" role=\"img\">";
  double x = 8.0;
  for (const int state : {0, 1, 2, 3, 4, 5, 6, int{kSilent}}) {
    const auto s = static_cast<std::uint8_t>(state);
    out += "<rect y=\"4\" width=\"12\" height=\"12\" x=\"" + format_fixed(x, 0) + "\" fill=\"" +
           state_colour(s) + "\"/><text class=\"tick\" y=\"14\" x=\"" + format_fixed(x + 17.0, 0) +
           "\">" + state_name(s) + "</text>";
    x += 40.0 + 7.0 * static_cast<double>(state_name(s).size());
  }
  return out + "</svg>\n";
}

std::string format_health(const Dive& dive, const std::vector<HealthPeriod>& periods) {
  HtmlTable table{
      "periods", {"state", "reason", "from [s]", "to [s]", "lasted [s]", "frames"}, {}, 2};
  std::size_t all = 0;
  for (const HealthPeriod& p : periods) {
    if (p.state == 1 || ++all > kMostRows) continue;
    table.rows.push_back({state_name(p.state), p.reason, format_fixed(p.begin_s, 2),
                          format_fixed(p.end_s, 2), format_fixed(p.duration_s(), 2),
                          std::to_string(p.frames)});
  }
  std::string out = "<h2>Health</h2>\n";
  if (periods.empty()) return out + "<p>No status was recorded.</p>\n";
  out += figure(format_health_strip(dive, periods, 2.0 * kChartWidth) + format_legend());
  if (table.rows.empty()) return out + "<p>Tracking all the time.</p>\n";
  return out + "<p>Every time that it was not tracking at its best:</p>\n" + format_html(table) +
         rest_of(all);
}

std::string format_complaints(const Dive& dive) {
  if (dive.complaints.empty()) return "";
  constexpr std::array<const char*, 4> kLevels = {"OK", "warning", "error", "stale"};
  HtmlTable table{"complaints", {"process", "level", "what it said", "from [s]", "to [s]"}, {}, 3};
  for (const DiveComplaint& c : dive.complaints) {
    if (table.rows.size() == kMostRows) break;
    table.rows.push_back(
        {c.name, c.level < kLevels.size() ? kLevels[c.level] : std::to_string(c.level), c.text,
         format_fixed(dive.seconds(c.begin_ns), 1), format_fixed(dive.seconds(c.end_ns), 1)});
  }
  return "<h2>What the other processes reported</h2>\n" + format_html(table) +
         rest_of(dive.complaints.size());
}

std::string format_series(const Dive& dive, const DiveSummary& summary) {
  std::string out = "<h2>Over time</h2>\n<div class=\"charts\">";
  for (const Chart& chart : charts_over_time(dive, summary)) {
    out += figure(format_chart(chart, kChartWidth, kChartHeight));
  }
  return out + "</div>\n";
}

std::string format_stages(const DiveSummary& summary) {
  if (summary.stages.empty()) return "";
  HtmlTable table{"stages", {"stage", "seen", "median [ms]", "95 % [ms]", "largest [ms]"}, {}};
  for (const DiveStage& stage : summary.stages) {
    table.rows.push_back({stage.name, std::to_string(stage.runs), format_fixed(stage.median_ms, 2),
                          format_fixed(stage.p95_ms, 2), format_fixed(stage.max_ms, 2)});
  }
  return "<h2>Times by stage</h2>\n<p>As told with the frames; a stage that runs twice between two "
         "frames is seen once.</p>\n" +
         format_html(table);
}

std::vector<std::string> error_row(const std::string& name, const Statistics& s, double unit,
                                   const std::string& scale) {
  std::vector<std::string> row = {name};
  for (const double v : {s.rmse, s.mean, s.median, s.p95, s.max}) {
    row.push_back(format_fixed(unit * v, 4));
  }
  row.push_back(scale);
  return row;
}

std::string format_relative(const EvaluationReport& r) {
  constexpr double kPer100m = 100.0 * 180.0 / std::numbers::pi;
  if (r.segments.empty()) return "<p>No piece of the way is long enough for relative errors.</p>\n";
  HtmlTable table{"relative",
                  {"length [m]", "pieces", "t mean [%]", "t RMS [%]", "t at best scale [%]",
                   "r mean [deg/100 m]"},
                  {}};
  const auto add = [&](const std::string& name, const SegmentSummary& s) {
    table.rows.push_back({name, std::to_string(s.count),
                          format_fixed(100.0 * s.translation_mean, 3),
                          format_fixed(100.0 * s.translation_rms, 3),
                          format_fixed(100.0 * s.translation_best_mean, 3),
                          format_fixed(kPer100m * s.rotation_mean, 3)});
  };
  for (const SegmentSummary& s : r.by_length) add(format_double(s.length), s);
  add("all", r.overall);
  return format_html(table);
}

std::string format_evaluation(const EvaluationReport& r) {
  HtmlTable absolute{
      "absolute", {"aligned by", "RMSE", "mean", "median", "95 %", "largest", "scale"}, {}};
  absolute.rows = {error_row("SE(3) [m]", r.rigid.translation, 1.0, "1"),
                   error_row("Sim(3) [m]", r.similarity.translation, 1.0,
                             format_fixed(r.similarity.S_truth_estimate.scale(), 5)),
                   error_row("rotation [deg]", r.rotation, 180.0 / std::numbers::pi, "")};
  std::string out = "<h2>Against the truth</h2>\n<p>" + std::to_string(r.compared) +
                    " poses compared over " + format_fixed(r.path_length, 2) + " m and " +
                    format_fixed(r.duration_s, 2) + " s; completion " +
                    format_fixed(100.0 * r.completion, 2) + " % of " + std::to_string(r.expected) +
                    " " + escape_html(r.expected_is) + ".</p>\n";
  for (const std::string& note : r.notes) out += "<p>" + escape_html(note) + "</p>\n";
  out += format_html(absolute) + format_relative(r);
  if (r.scale.count > 0) {
    out += "<p>Scale error over " + format_double(r.scale_length) + " m: median " +
           format_fixed(100.0 * r.scale.median_abs, 3) +
           " %, 95 %: " + format_fixed(100.0 * r.scale.p95_abs, 3) + " %, bias " +
           format_fixed(100.0 * r.scale.bias, 3) + " %.</p>\n";
  }
  return out;
}

std::string format_recording(const Dive& dive) {
  HtmlTable table{"topics", {"topic", "type", "messages", "a second", "dropped"}, {}, 2};
  const double duration = dive.duration_s();
  for (const DiveTopic& t : dive.topics) {
    if (table.rows.size() == kMostRows) break;
    const double rate = duration > 0.0 ? static_cast<double>(t.messages) / duration : 0.0;
    table.rows.push_back({t.topic, t.type, std::to_string(t.messages), format_fixed(rate, 1),
                          t.dropped.empty() ? "0" : t.dropped});
  }
  std::string out = "<h2>The recording</h2>\n";
  if (!dive.notes.empty()) {
    out += "<ul id=\"notes\">";
    for (const std::string& note : dive.notes) out += "<li>" + escape_html(note) + "</li>\n";
    out += "</ul>\n";
  }
  return out + format_html(table) + rest_of(dive.topics.size());
}

}  // namespace

std::vector<Dive> shown_runs(const Dive& dive) { return runs_of(dive, kMostRuns); }

std::string format_report_page(const Dive& dive, const std::optional<DiveEvaluation>& evaluation,
                               const std::vector<std::vector<Vec3>>& maps) {
  const DiveSummary summary = summarize(dive);
  const auto periods = health_timeline(dive);
  const std::vector<Vec3> nothing;
  const std::size_t num_runs = count_runs(dive);
  std::vector<Dive> runs = shown_runs(dive);
  if (runs.empty()) runs.push_back(dive);
  std::string page = format_head(dive) + format_tiles(summary, periods);
  page += format_runs(num_runs, runs.size());
  for (const Dive& run : runs) {
    const bool is_compared =
        evaluation && !run.poses.empty() && run.poses.front().run == evaluation->run;
    page += format_trajectory(run, is_compared ? evaluation->truth : nothing, num_runs);
  }
  if (evaluation) page += format_evaluation(evaluation->report);
  page += format_health(dive, periods) + format_complaints(dive);
  page += format_series(dive, summary);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    page += format_map(runs[i], i < maps.size() ? maps[i] : nothing, num_runs);
  }
  page += format_stages(summary);
  return page + format_recording(dive) + "</body></html>\n";
}

}  // namespace sovo::app
