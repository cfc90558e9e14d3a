#pragma once

#include <string>
#include <vector>

#include "sovo/app/report/dive.h"
#include "sovo/app/report/dive_summary.h"
#include "sovo/app/report/health_timeline.h"
#include "sovo/eval/svg_chart.h"

namespace sovo::app {

// Charts of a dive. Lines are thinned to what can be seen, extremes kept. Colours are variables of
// the page's style.

/// Poses from above (x and y of odom), or from the side (the longer of the two, and z). `truth`
/// may be empty.
Chart chart_from_above(const Dive& dive, const std::vector<Vec3>& truth);
Chart chart_from_side(const Dive& dive, const std::vector<Vec3>& truth);

/// Points from above, coloured by height, and the trajectory over them.
Chart chart_of_map(const Dive& dive, const std::vector<Vec3>& points);

/// Speed, depth, scale with its band of two sigma, scale residual, latency, rate and losses over
/// time; those without data are left out.
std::vector<Chart> charts_over_time(const Dive& dive, const DiveSummary& summary);

/// States over time as a strip of `width` pixels, as SVG.
std::string format_health_strip(const Dive& dive, const std::vector<HealthPeriod>& periods,
                                double width);

/// Variable of the page's style for a state.
std::string state_colour(std::uint8_t state);

}  // namespace sovo::app
