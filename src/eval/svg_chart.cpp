#include "sovo/eval/svg_chart.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sovo/io/text.h"

namespace sovo {
namespace {

constexpr double kColumn = 560.0;
constexpr double kRow = 300.0;
constexpr double kHeader = 44.0;
constexpr double kLeft = 66.0;  // Room for tick labels and the axis' name.
constexpr double kRight = 16.0;
constexpr double kTop = 34.0;
constexpr double kBottom = 48.0;

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void add(double v) {
    low = std::min(low, v);
    high = std::max(high, v);
  }
  double size() const { return high - low; }
  void widen_to(double wanted) {
    const double more = 0.5 * (wanted - size());
    low -= more;
    high += more;
  }
};

/// Place of a chart on the page and the ranges that its axes show.
struct Frame {
  double x, y, width, height;  // The plotting area [px].
  Range xs, ys;
  double px(double v) const { return x + (v - xs.low) / xs.size() * width; }
  double py(double v) const { return y + height - (v - ys.low) / ys.size() * height; }
};

std::string escape(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&') {
      out += "&amp;";
    } else if (c == '<') {
      out += "&lt;";
    } else if (c == '>') {
      out += "&gt;";
    } else {
      out += c;
    }
  }
  return out;
}

std::string coordinate(double v) { return format_fixed(v, 1); }

std::string attribute(const std::string& name, double v) {
  return " " + name + "=\"" + coordinate(v) + "\"";
}

std::string text_at(double x, double y, const std::string& style, const std::string& text) {
  return "<text" + attribute("x", x) + attribute("y", y) + " " + style + ">" + escape(text) +
         "</text>\n";
}

std::string line_at(double x1, double y1, double x2, double y2, const std::string& style) {
  return "<line" + attribute("x1", x1) + attribute("y1", y1) + attribute("x2", x2) +
         attribute("y2", y2) + " " + style + "/>\n";
}

/// The ranges of the data with a margin; never empty.
void fit_ranges(const Chart& chart, Frame* frame) {
  for (const ChartSeries& series : chart.series) {
    for (const auto& [x, y] : series.points) {
      if (!std::isfinite(x) || !std::isfinite(y)) continue;
      frame->xs.add(x);
      frame->ys.add(y);
    }
  }
  if (frame->xs.size() < 0.0) {
    frame->xs = {0.0, 1.0};
    frame->ys = {0.0, 1.0};
  }
  const double y_low = frame->ys.low;
  if (frame->ys.size() < 1e-12) frame->ys.widen_to(std::max(1e-9, 0.2 * std::abs(y_low)));
  if (frame->xs.size() < 1e-12) frame->xs.widen_to(1.0);
  frame->ys.widen_to(1.1 * frame->ys.size());
  if (chart.y_from_zero) frame->ys.low = 0.0;
  if (!chart.equal_axes) return;
  frame->xs.widen_to(1.1 * frame->xs.size());
  const double unit = std::max(frame->xs.size() / frame->width, frame->ys.size() / frame->height);
  frame->xs.widen_to(unit * frame->width);
  frame->ys.widen_to(unit * frame->height);
}

/// Tick text without more digits than the spacing needs; powers of ten where it is tiny.
std::string tick_text(double value, double spacing) {
  if (spacing < 1e-4) {
    const double multiple = std::round(value / spacing);
    const double power = std::floor(std::log10(spacing) + 1e-9);
    const double shown = multiple * std::round(spacing / std::pow(10.0, power));
    return shown == 0.0 ? "0" : format_fixed(shown, 0) + "e" + format_fixed(power, 0);
  }
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(spacing) - 1e-9)), 0, 9);
  const double shown = std::abs(value) < 1e-9 * spacing ? 0.0 : value;
  return format_fixed(shown, decimals);
}

std::string draw_axes(const Chart& chart, const Frame& f) {
  std::string out = "<rect" + attribute("x", f.x) + attribute("y", f.y) +
                    attribute("width", f.width) + attribute("height", f.height) +
                    " class=\"area\"/>\n";
  const auto xs = axis_ticks(f.xs.low, f.xs.high, 7);
  for (const double v : xs) {
    out += line_at(f.px(v), f.y, f.px(v), f.y + f.height, "class=\"grid\"");
    out += text_at(f.px(v), f.y + f.height + 16, "class=\"tick\" text-anchor=\"middle\"",
                   tick_text(v, xs.size() > 1 ? xs[1] - xs[0] : 1.0));
  }
  const auto ys = axis_ticks(f.ys.low, f.ys.high, static_cast<int>(f.height / 45.0));
  for (const double v : ys) {
    out += line_at(f.x, f.py(v), f.x + f.width, f.py(v), "class=\"grid\"");
    out += text_at(f.x - 6, f.py(v) + 4, "class=\"tick\" text-anchor=\"end\"",
                   tick_text(v, ys.size() > 1 ? ys[1] - ys[0] : 1.0));
  }
  const double middle = f.y + 0.5 * f.height;
  const std::string turn = "class=\"label\" text-anchor=\"middle\" transform=\"rotate(-90 " +
                           coordinate(f.x - 50) + " " + coordinate(middle) + ")\"";
  out += text_at(f.x - 50, middle, turn, chart.y_label);
  out += text_at(f.x + 0.5 * f.width, f.y + f.height + 36, "class=\"label\" text-anchor=\"middle\"",
                 chart.x_label);
  out += text_at(f.x, f.y - 12, "class=\"title\"", chart.title);
  return out;
}

/// Dots of a cloud: lines without length, with round ends.
std::string draw_cloud(const ChartSeries& series, const Frame& f) {
  std::string path;
  for (const auto& [x, y] : series.points) {
    if (!std::isfinite(x) || !std::isfinite(y)) continue;
    path += "M" + coordinate(f.px(x)) + " " + coordinate(f.py(y)) + "h0";
  }
  if (path.empty()) return "";
  return "<path d=\"" + path + "\" stroke=\"" + series.colour + "\" class=\"cloud\"/>\n";
}

std::string draw_series(const ChartSeries& series, const Frame& f) {
  if (series.cloud) return draw_cloud(series, f);
  std::string path;
  std::string dots;
  bool pen_down = false;
  for (const auto& [x, y] : series.points) {
    if (!std::isfinite(x) || !std::isfinite(y)) {
      if (pen_down && series.area) path += "Z";
      pen_down = false;
      continue;
    }
    path += (pen_down ? "L" : "M") + coordinate(f.px(x)) + " " + coordinate(f.py(y));
    pen_down = true;
    if (series.markers) {
      dots += "<circle" + attribute("cx", f.px(x)) + attribute("cy", f.py(y)) +
              " r=\"3.5\" fill=\"" + series.colour + "\"/>\n";
    }
  }
  if (path.empty()) return "";
  if (series.area) {
    return "<path d=\"" + path + "Z\" fill=\"" + series.colour + "\" class=\"band\"/>\n";
  }
  return "<path d=\"" + path + "\" stroke=\"" + series.colour + "\" class=\"line\"" +
         (series.dashed ? " stroke-dasharray=\"6 4\"" : "") + "/>\n" + dots;
}

std::string draw_legend(const Chart& chart, const Frame& f) {
  std::string out;
  double x = f.x + f.width;
  for (std::size_t i = chart.series.size(); i-- > 0;) {
    const auto& series = chart.series[i];
    if (series.name.empty()) continue;
    x -= 7.0 * static_cast<double>(series.name.size()) + 4.0;
    out += text_at(x, f.y - 12, "class=\"tick\"", series.name);
    out += line_at(x - 26, f.y - 16, x - 6, f.y - 16,
                   "class=\"line\" stroke=\"" + series.colour + "\"" +
                       (series.dashed ? " stroke-dasharray=\"6 4\"" : ""));
    x -= 40.0;
  }
  return out;
}

std::string draw_chart(const Chart& chart, double x, double y, double width, double height) {
  Frame frame{x + kLeft, y + kTop, width - kLeft - kRight, height - kTop - kBottom, {}, {}};
  fit_ranges(chart, &frame);
  std::string out = draw_axes(chart, frame);
  for (const ChartSeries& series : chart.series) out += draw_series(series, frame);
  return out + draw_legend(chart, frame);
}

constexpr const char* kStyle =
    "<style>text{font-family:sans-serif;fill:#333}.head{font-size:17px;font-weight:bold}"
    ".title{font-size:14px;font-weight:bold}.label{font-size:12px}.tick{font-size:11px}"
    ".area{fill:#fff;stroke:#999}.grid{stroke:#e4e4e4}"
    ".line{fill:none;stroke-width:1.8;stroke-linejoin:round}</style>\n";

}  // namespace

std::vector<double> axis_ticks(double low, double high, int count) {
  std::vector<double> ticks;
  if (!(high > low) || count < 1) return ticks;
  const double raw = (high - low) / count;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  double spacing = 10.0 * power;
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= raw * (1.0 - 1e-9)) {
      spacing = factor * power;
      break;
    }
  }
  const double first = std::ceil(low / spacing - 1e-9);
  // Counted, for a step may be lost beside a number that is large enough.
  for (int i = 0; i <= 2 * count; ++i) {
    const double tick = (first + i) * spacing;
    if (!(tick <= high + 1e-9 * spacing)) break;
    ticks.push_back(tick);
  }
  return ticks;
}

std::string format_chart(const Chart& chart, double width, double height) {
  return "<svg viewBox=\"0 0 " + coordinate(width) + " " + coordinate(height) +
         "\" role=\"img\">\n" + draw_chart(chart, 0.0, 0.0, width, height) + "</svg>\n";
}

std::string format_charts(const std::string& title, const std::vector<Chart>& charts) {
  double heights[2] = {kHeader, kHeader};
  std::string body;
  for (const Chart& chart : charts) {
    const int column = heights[0] <= heights[1] ? 0 : 1;
    const double height = chart.equal_axes ? 2.0 * kRow : kRow;
    body += draw_chart(chart, column * kColumn, heights[column], kColumn, height);
    heights[column] += height;
  }
  const std::string width = coordinate(2.0 * kColumn);
  const std::string height = coordinate(std::max(heights[0], heights[1]));
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + width + "\" height=\"" + height +
         "\" viewBox=\"0 0 " + width + " " + height + "\">\n" + kStyle +
         "<rect width=\"100%\" height=\"100%\" fill=\"#fafafa\"/>\n" +
         text_at(18.0, 28.0, "class=\"head\"", title) + body + "</svg>\n";
}

}  // namespace sovo
