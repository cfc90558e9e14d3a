#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sovo/app/report/dive.h"
#include "sovo/app/report/dive_evaluation.h"

namespace sovo::app {

/// The runs that the page draws by themselves.
std::vector<Dive> shown_runs(const Dive& dive);

/// One HTML page about a dive that needs nothing else: pictures are SVG, the style is inside, there
/// are no scripts, and its own policy lets a browser load nothing. Texts of the recording are
/// escaped. `maps`: for each of `shown_runs` its points in odom [m]; may be empty.
std::string format_report_page(const Dive& dive, const std::optional<DiveEvaluation>& evaluation,
                               const std::vector<std::vector<Vec3>>& maps);

}  // namespace sovo::app
