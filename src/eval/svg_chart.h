#pragma once

#include <string>
#include <utility>
#include <vector>

namespace sovo {

/// A line of a chart.
struct ChartSeries {
  std::string name;                               ///< For the legend; empty: not in it.
  std::string colour;                             ///< As SVG writes it.
  std::vector<std::pair<double, double>> points;  ///< Points that are not finite break the line.
  bool dashed = false;
  bool markers = false;  ///< A dot at each point.
  bool area = false;     ///< The points are the outline of a filled area.
  bool cloud = false;    ///< Small dots and no line.
};

/// A chart with axes in data units.
struct Chart {
  std::string title;
  std::string x_label;
  std::string y_label;
  std::vector<ChartSeries> series;
  bool equal_axes = false;   ///< One unit is as long on both axes, as a map needs.
  bool y_from_zero = false;  ///< The vertical axis begins at zero.
};

/// One SVG image with the charts in two columns under a title; a map (equal axes) takes the place
/// of two charts, one above the other.
std::string format_charts(const std::string& title, const std::vector<Chart>& charts);

/// One chart as an SVG image of its own, for a page that has styles for the classes `area`, `grid`,
/// `tick`, `label`, `title`, `line`, `band` and `cloud`. Size in pixels.
std::string format_chart(const Chart& chart, double width, double height);

/// Round numbers (1, 2 or 5 times a power of ten apart) in [low, high], about `count` of them.
std::vector<double> axis_ticks(double low, double high, int count);

}  // namespace sovo
