#include "sovo/app/report/report_charts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>

#include "sovo/app/report/html.h"
#include "sovo/eval/statistics.h"
#include "sovo/io/text.h"

namespace sovo::app {
namespace {

using Point = std::pair<double, double>;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr Point kBreak = {kNan, kNan};
constexpr std::size_t kColumns = 800;         // Of a chart over time.
constexpr double kPathDetail = 1.0 / 2000.0;  // Of the extent.
constexpr char kTruth[] = "var(--truth)";
constexpr char kMain[] = "var(--main)";
constexpr char kSecond[] = "var(--second)";
constexpr char kWarn[] = "var(--warn)";

/// The axis of time in a unit that suits the length of the dive.
struct TimeAxis {
  double unit_s = 1.0;
  std::string label = "time [s]";
};

TimeAxis time_axis(const Dive& dive) {
  if (dive.duration_s() > 3.0 * 3600.0) return {3600.0, "time [h]"};
  if (dive.duration_s() > 300.0) return {60.0, "time [min]"};
  return {};
}

/// Smallest and largest value in each column of a line, in the order of time; gaps are kept.
std::vector<Point> thinned(const std::vector<Point>& line, double span) {
  const double width = span > 0.0 ? span / static_cast<double>(kColumns) : 1.0;
  std::vector<Point> out;
  for (std::size_t i = 0; i < line.size();) {
    if (!std::isfinite(line[i].second)) {
      if (!out.empty() && std::isfinite(out.back().second)) out.push_back(kBreak);
      ++i;
      continue;
    }
    const double column = std::floor(line[i].first / width);
    std::size_t low = i, high = i;
    for (; i < line.size() && std::isfinite(line[i].second) &&
           std::floor(line[i].first / width) == column;
         ++i) {
      if (line[i].second < line[low].second) low = i;
      if (line[i].second > line[high].second) high = i;
    }
    out.push_back(line[std::min(low, high)]);
    if (low != high) out.push_back(line[std::max(low, high)]);
  }
  return out;
}

/// A value of each metric pose over time, broken where there is none and where a segment begins.
std::vector<Point> over_time(const Dive& dive, const TimeAxis& axis,
                             const std::function<double(const DivePose&)>& value) {
  std::vector<Point> line;
  const DivePose* before = nullptr;
  for (const DivePose& pose : dive.poses) {
    const double t = dive.seconds(pose.log_ns);
    if (before != nullptr && !goes_on(*before, pose)) line.push_back(kBreak);
    line.emplace_back(t / axis.unit_s, pose.metric ? value(pose) : kNan);
    before = &pose;
  }
  return thinned(line, dive.duration_s() / axis.unit_s);
}

/// Outline of the area between `low` and `high`, which run in parallel; a loop for each piece.
std::vector<Point> outline(const std::vector<Point>& low, const std::vector<Point>& high) {
  std::vector<Point> out;
  std::size_t begin = 0;
  for (std::size_t i = 0; i <= low.size(); ++i) {
    const bool inside =
        i < low.size() && std::isfinite(low[i].second) && std::isfinite(high[i].second);
    if (inside) continue;
    for (std::size_t k = begin; k < i; ++k) out.push_back(high[k]);
    for (std::size_t k = i; k > begin; --k) out.push_back(low[k - 1]);
    if (i > begin) out.push_back(kBreak);
    begin = i + 1;
  }
  return out;
}

Chart scale_chart(const Dive& dive, const TimeAxis& axis) {
  // Every n-th pose: both edges of the band must run in parallel.
  const std::size_t stride = 1 + dive.poses.size() / (2 * kColumns);
  std::vector<Point> line, low, high;
  const DivePose* before = nullptr;
  for (std::size_t i = 0; i < dive.poses.size(); i += stride) {
    const DivePose& pose = dive.poses[i];
    const bool begins = before != nullptr && is_other_map(*before, pose);
    for (auto* points : {&line, &low, &high}) {
      if (begins) points->push_back(kBreak);
    }
    const double t = dive.seconds(pose.log_ns) / axis.unit_s;
    const double scale = pose.metric ? std::exp(pose.log_scale) : kNan;
    const double factor = std::exp(2.0 * pose.log_scale_sigma);
    line.emplace_back(t, scale);
    low.emplace_back(t, scale / factor);
    high.emplace_back(t, scale * factor);
    before = &pose;
  }
  ChartSeries band{"2 sigma", "var(--band)", outline(low, high)};
  band.area = true;
  return {"Scale, product of corrections", axis.label, "scale [1]", {band, {"scale", kMain, line}}};
}

/// Whether there is something to see: what nobody measured is zero.
bool has_points(const Chart& chart) {
  return std::any_of(chart.series.begin(), chart.series.end(), [](const ChartSeries& series) {
    return std::any_of(series.points.begin(), series.points.end(),
                       [](const Point& p) { return std::isfinite(p.second) && p.second != 0.0; });
  });
}

Chart simple_chart(const std::string& title, const TimeAxis& axis, const std::string& y_label,
                   std::vector<Point> line, bool from_zero) {
  return {title, axis.label, y_label, {{"", kMain, std::move(line)}}, false, from_zero};
}

Chart status_chart(const Dive& dive, const TimeAxis& axis, const std::string& title,
                   const std::string& y_label, double DiveStatus::*value, double unit) {
  std::vector<Point> line;
  for (const DiveStatus& status : dive.statuses) {
    line.emplace_back(dive.seconds(status.log_ns) / axis.unit_s, status.*value / unit);
  }
  return simple_chart(title, axis, y_label, thinned(line, dive.duration_s() / axis.unit_s), true);
}

std::vector<Chart> rate_charts(const DiveSummary& summary, const TimeAxis& axis) {
  std::vector<Point> frames, losses;
  bool any = false;
  for (const DiveRate& rate : summary.rates) {
    frames.emplace_back(rate.time_s / axis.unit_s, rate.frames);
    losses.emplace_back(rate.time_s / axis.unit_s, static_cast<double>(rate.losses));
    any = any || rate.losses > 0;
  }
  std::vector<Chart> charts = {
      simple_chart("Frames reported on", axis, "rate [1/s]", frames, true)};
  if (any) {
    charts.push_back(
        simple_chart("Frames lost, dropped or refused", axis, "frames a bin", losses, true));
    charts.back().series.front().colour = kWarn;
  }
  return charts;
}

/// Where the metric poses were, in two of odom's axes; broken between segments. Only what is in
/// state `tracking`, or only what is not.
std::vector<Point> path_of(const Dive& dive, int across, int up, double detail, bool tracking) {
  std::vector<Point> out;
  const DivePose* before = nullptr;
  Point drawn = kBreak;
  for (const DivePose& pose : dive.poses) {
    if (!pose.metric) continue;
    const bool wanted = (pose.state == 1) == tracking;
    const bool begins = before == nullptr || !goes_on(*before, pose);
    const bool continues = !begins && ((before->state == 1) == tracking);
    const Vec3& t = pose.T_odom_base.translation();
    const Point here(t[across], t[up]);
    if ((begins || !wanted) && !out.empty() && std::isfinite(out.back().first)) {
      out.push_back(kBreak);
    }
    if (wanted) {
      if (!begins && !continues) {
        const Vec3& b = before->T_odom_base.translation();
        out.emplace_back(b[across], b[up]);
      }
      const bool moved =
          !(std::hypot(here.first - drawn.first, here.second - drawn.second) < detail);
      if (begins || !continues || moved) {
        out.push_back(here);
        drawn = here;
      }
    }
    before = &pose;
  }
  return out;
}

struct Extent {
  Vec3 low = Vec3::Zero();
  Vec3 high = Vec3::Zero();
  Vec3 size() const { return high - low; }
};

Extent extent_of(const Dive& dive) {
  Extent extent;
  bool any = false;
  for (const DivePose& pose : dive.poses) {
    if (!pose.metric) continue;
    const Vec3& t = pose.T_odom_base.translation();
    extent.low = any ? Vec3(extent.low.cwiseMin(t)) : t;
    extent.high = any ? Vec3(extent.high.cwiseMax(t)) : t;
    any = true;
  }
  return extent;
}

Chart path_chart(const Dive& dive, const std::vector<Vec3>& truth, const std::string& title,
                 int across, int up) {
  constexpr std::array<const char*, 3> kAxes{"x [m]", "y [m]", "z [m]"};
  const Extent extent = extent_of(dive);
  const double detail = kPathDetail * extent.size().maxCoeff();
  Chart chart{title, kAxes[across], kAxes[up], {}, true};
  ChartSeries laid{"truth", kTruth, {}, true};
  for (const Vec3& t : truth) {
    const Point here(t[across], t[up]);
    if (laid.points.empty() || std::hypot(here.first - laid.points.back().first,
                                          here.second - laid.points.back().second) >= detail) {
      laid.points.push_back(here);
    }
  }
  chart.series.push_back({"tracking", kMain, path_of(dive, across, up, detail, true)});
  ChartSeries other{"not at its best", kWarn, path_of(dive, across, up, detail, false)};
  if (!other.points.empty()) chart.series.push_back(std::move(other));
  if (!laid.points.empty()) chart.series.push_back(std::move(laid));
  return chart;
}

}  // namespace

Chart chart_from_above(const Dive& dive, const std::vector<Vec3>& truth) {
  return path_chart(dive, truth, "From above", 0, 1);
}

Chart chart_from_side(const Dive& dive, const std::vector<Vec3>& truth) {
  const Vec3 size = extent_of(dive).size();
  return path_chart(dive, truth, "From the side", size.x() >= size.y() ? 0 : 1, 2);
}

Chart chart_of_map(const Dive& dive, const std::vector<Vec3>& points) {
  constexpr std::size_t kLayers = 6;
  Chart chart{"Map from above, light is high", "x [m]", "y [m]", {}, true};
  std::array<std::vector<double>, 3> values;
  for (const Vec3& p : points) {
    for (int k = 0; k < 3; ++k) values[k].push_back(p[k]);
  }
  // Single points far outside must not make the rest small.
  const Extent path = extent_of(dive);
  const double margin = 1.0 + 0.5 * path.size().head<2>().maxCoeff();
  std::array<double, 2> low{}, high{};
  for (int k = 0; k < 2; ++k) {
    low[k] = std::min(path.low[k], quantile(values[k], 0.02) - margin);
    high[k] = std::max(path.high[k], quantile(values[k], 0.98) + margin);
  }
  std::array<double, kLayers - 1> heights{};
  for (std::size_t i = 0; i + 1 < kLayers; ++i) {
    heights[i] = quantile(values[2], static_cast<double>(i + 1) / kLayers);
  }
  for (std::size_t i = 0; i < kLayers; ++i) {
    ChartSeries layer{"", "var(--h" + std::to_string(i) + ")", {}};
    layer.cloud = true;
    chart.series.push_back(std::move(layer));
  }
  for (const Vec3& p : points) {
    if (p.x() < low[0] || p.x() > high[0] || p.y() < low[1] || p.y() > high[1]) continue;
    const auto layer = std::upper_bound(heights.begin(), heights.end(), p.z()) - heights.begin();
    chart.series[static_cast<std::size_t>(layer)].points.emplace_back(p.x(), p.y());
  }
  const double detail = kPathDetail * path.size().maxCoeff();
  chart.series.push_back({"way", kSecond, path_of(dive, 0, 1, detail, true)});
  return chart;
}

std::vector<Chart> charts_over_time(const Dive& dive, const DiveSummary& summary) {
  const TimeAxis axis = time_axis(dive);
  std::vector<Chart> charts = {
      simple_chart("Speed", axis, "speed [m/s]",
                   over_time(dive, axis, [](const DivePose& p) { return p.speed; }), true),
      simple_chart(
          "Depth: -z of odom", axis, "depth [m]",
          over_time(dive, axis, [](const DivePose& p) { return -p.T_odom_base.translation().z(); }),
          false),
      scale_chart(dive, axis),
      simple_chart("Scale residual", axis, "[grey levels]",
                   over_time(dive, axis, [](const DivePose& p) { return p.scale_residual; }), true),
      status_chart(dive, axis, "Latency, exposure to publication", "latency [ms]",
                   &DiveStatus::latency_s, 1e-3),
      status_chart(dive, axis, "Between the exposures of a pair", "difference [ms]",
                   &DiveStatus::sync_error_s, 1e-3)};
  for (Chart& chart : rate_charts(summary, axis)) charts.push_back(std::move(chart));
  std::erase_if(charts, [](const Chart& chart) { return !has_points(chart); });
  return charts;
}

std::string state_colour(std::uint8_t state) {
  constexpr std::array<const char*, 7> kColours = {"init", "good", "warn", "poor",
                                                   "bad",  "init", "off"};
  return std::string("var(--") + (state < kColours.size() ? kColours[state] : "off") + ")";
}

std::string format_health_strip(const Dive& dive, const std::vector<HealthPeriod>& periods,
                                double width) {
  constexpr double kHeight = 46.0, kBar = 26.0, kEdge = 8.0;
  const TimeAxis axis = time_axis(dive);
  const double span = std::max(dive.duration_s(), 1e-3);
  const auto px = [&](double seconds) { return kEdge + (width - 2 * kEdge) * seconds / span; };
  const auto number = [](double v) { return format_fixed(v, 1); };
  std::string out =
      "<svg viewBox=\"0 0 " + number(width) + " " + number(kHeight) + "\" role=\"img\">\n";
  std::map<std::uint8_t, double> drawn_to;
  for (const HealthPeriod& p : periods) {
    // What is good may be too short to be seen; what is not must be seen.
    const double wide = px(p.end_s) - px(p.begin_s);
    double& drawn = drawn_to[p.state];
    if (px(p.end_s) <= drawn) continue;
    drawn = px(p.begin_s) + std::max(wide, 1.0);
    out += "<rect x=\"" + number(px(p.begin_s)) + "\" y=\"0\" width=\"" +
           number(p.state == 1 ? wide : std::max(wide, 1.0)) + "\" height=\"" + number(kBar) +
           "\" fill=\"" + state_colour(p.state) + "\"><title>" +
           escape_html(state_name(p.state) + ", " + format_fixed(p.begin_s, 1) + " to " +
                       format_fixed(p.end_s, 1) + " s") +
           "</title></rect>\n";
  }
  for (const double tick : axis_ticks(0.0, span / axis.unit_s, 10)) {
    out += "<text class=\"tick\" text-anchor=\"middle\" x=\"" + number(px(tick * axis.unit_s)) +
           "\" y=\"" + number(kHeight - 4.0) + "\">" +
           format_double(std::round(1e6 * tick) * 1e-6) + "</text>\n";
  }
  return out + "</svg>\n";
}

}  // namespace sovo::app
