#include <algorithm>
#include <array>
#include <numbers>

#include "sovo/eval/evaluation.h"
#include "sovo/eval/svg_chart.h"
#include "sovo/io/text.h"

namespace sovo {
namespace {

constexpr const char* kTruthColour = "#777777";
constexpr const char* kEstimateColour = "#1f77b4";
constexpr const char* kSecondColour = "#d62728";

/// The two axes along which the truth extends most, in order x, y, z; for a camera whose world is
/// its first frame these are x and z.
std::pair<int, int> map_axes(const std::vector<SE3>& truth) {
  Vec3 low = truth.front().translation();
  Vec3 high = low;
  for (const SE3& pose : truth) {
    low = low.cwiseMin(pose.translation());
    high = high.cwiseMax(pose.translation());
  }
  int smallest = 0;
  (high - low).minCoeff(&smallest);
  return {smallest == 0 ? 1 : 0, smallest == 2 ? 1 : 2};
}

Chart trajectory_chart(const EvaluationReport& r) {
  const auto [horizontal, vertical] = map_axes(r.truth);
  constexpr std::array<const char*, 3> kAxes{"x [m]", "y [m]", "z [m]"};
  Chart chart{"Trajectory, aligned by SE(3)", kAxes[horizontal], kAxes[vertical], {}, true};
  ChartSeries truth{"truth", kTruthColour, {}, true};
  ChartSeries estimate{"estimate", kEstimateColour, {}};
  for (std::size_t i = 0; i < r.truth.size(); ++i) {
    const Vec3& t = r.truth[i].translation();
    const Vec3 e = r.rigid.S_truth_estimate * r.estimate[i].translation();
    truth.points.emplace_back(t[horizontal], t[vertical]);
    estimate.points.emplace_back(e[horizontal], e[vertical]);
  }
  chart.series = {estimate, truth};
  return chart;
}

/// The horizontal axis of errors along the way: distance, or time when little is travelled.
struct Way {
  std::string label;
  const std::vector<double>& values;
};

Way way_of(const EvaluationReport& r) {
  constexpr double kLeast = 5.0;  // [m]
  if (r.path_length < kLeast) return {"time [s]", r.times};
  return {"distance travelled [m]", r.distances};
}

Chart absolute_chart(const EvaluationReport& r) {
  const Way way = way_of(r);
  Chart chart{"Absolute error, RMSE", way.label, "error [m]", {}, false, true};
  const auto series = [&](const std::string& name, const char* colour, const AbsoluteError& e) {
    ChartSeries s{name + " " + format_fixed(e.translation.rmse, 4) + " m", colour, {}};
    for (std::size_t i = 0; i < e.errors.size(); ++i) {
      s.points.emplace_back(way.values[i], e.errors[i]);
    }
    return s;
  };
  chart.series = {series("SE(3)", kEstimateColour, r.rigid),
                  series("Sim(3)", kSecondColour, r.similarity)};
  return chart;
}

Chart translation_chart(const EvaluationReport& r) {
  Chart chart{"Relative translation", "length [m]", "error [%]", {}, false, true};
  ChartSeries mean{"mean", kEstimateColour, {}, false, true};
  ChartSeries best{"at best scale", kSecondColour, {}, true, true};
  for (const SegmentSummary& s : r.by_length) {
    mean.points.emplace_back(s.length, 100.0 * s.translation_mean);
    best.points.emplace_back(s.length, 100.0 * s.translation_best_mean);
  }
  chart.series = {mean, best};
  return chart;
}

Chart rotation_chart(const EvaluationReport& r) {
  Chart chart{"Relative rotation", "length [m]", "error [deg/100 m]", {}, false, true};
  ChartSeries mean{"", kEstimateColour, {}, false, true};
  for (const SegmentSummary& s : r.by_length) {
    mean.points.emplace_back(s.length, 100.0 * 180.0 / std::numbers::pi * s.rotation_mean);
  }
  chart.series = {mean};
  return chart;
}

Chart scale_chart(const EvaluationReport& r) {
  const Way way = way_of(r);
  Chart chart{"Scale error over " + format_double(r.scale_length) + " m",
              way.label,
              "ln(true / estimated) [%]",
              {}};
  ChartSeries error{"", kEstimateColour, {}};
  ChartSeries zero{"", kTruthColour, {}, true};
  for (const ScaleSample& s : r.scale_samples) {
    error.points.emplace_back(way.values[s.first], 100.0 * s.log_scale);
  }
  zero.points = {{way.values.front(), 0.0}, {way.values.back(), 0.0}};
  chart.series = {zero, error};
  return chart;
}

}  // namespace

std::string format_svg(const EvaluationReport& r, const std::string& title) {
  std::vector<Chart> charts{trajectory_chart(r), absolute_chart(r)};
  if (!r.scale_samples.empty()) charts.push_back(scale_chart(r));
  if (!r.by_length.empty()) {
    charts.push_back(translation_chart(r));
    charts.push_back(rotation_chart(r));
  }
  return format_charts(title, charts);
}

}  // namespace sovo
