#include "sovo/scale/scale_search.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace sovo {

namespace {

constexpr double kMinStep = 0.01;  ///< Of the grid: a shift as large as the image.
constexpr double kMaxStep = 0.06;
constexpr std::size_t kMaxModes = 4;
constexpr double kSameMode = 0.05;  ///< Minima closer than this are one [log-scale].
constexpr double kMinShift = 2.0;   ///< Of the points that compare modes [px].

struct Mode {
  double sigma = 0.0;
  double score = -1.0;
};

/// Correlation over the whole range.
std::vector<Mode> scan(const ScaleOptimizerConfig& config, int min_count,
                       ScaleAlignment* alignment) {
  std::vector<Mode> grid;
  double sigma = config.min_log_scale;
  while (sigma <= config.max_log_scale) {
    grid.push_back({sigma, alignment->correlation(sigma, min_count)});
    sigma += std::clamp(1.0 / (1.5 * alignment->mean_shift() + 1e-9), kMinStep, kMaxStep);
  }
  return grid;
}

/// Local maxima, best first; the ends of the range count.
std::vector<Mode> modes_of(const std::vector<Mode>& grid) {
  std::vector<Mode> modes;
  for (std::size_t i = 0; i < grid.size(); ++i) {
    const bool above_left = i == 0 || grid[i].score > grid[i - 1].score;
    const bool above_right = i + 1 == grid.size() || grid[i].score >= grid[i + 1].score;
    if (above_left && above_right && grid[i].score > 0.0) modes.push_back(grid[i]);
  }
  std::stable_sort(modes.begin(), modes.end(),
                   [](const Mode& a, const Mode& b) { return a.score > b.score; });
  if (modes.size() > kMaxModes) modes.resize(kMaxModes);
  return modes;
}

/// Gauss-Newton from a mode of the grid down to level 1.
void refine(int coarsest_level, ScaleAlignment* alignment, Mode* mode, int* iterations) {
  alignment->restart();
  double sigma = mode->sigma;
  for (int level = coarsest_level; level >= std::min(1, coarsest_level); --level) {
    alignment->set_level(level);
    if (!alignment->minimize(1e-3 * (1 << level), &sigma, iterations)) return;
    mode->sigma = sigma;
  }
}

double ambiguity_of(const std::vector<Mode>& modes) {
  for (std::size_t i = 1; i < modes.size(); ++i) {
    if (std::abs(modes[i].sigma - modes[0].sigma) < kSameMode) continue;
    return std::min(1.0, (1.0 - modes[0].score) / std::max(1e-9, 1.0 - modes[i].score));
  }
  return 0.0;
}

}  // namespace

ScaleSearch search_scale(const ScaleOptimizerConfig& config, int num_points, int coarsest_level,
                         ScaleAlignment* alignment) {
  ScaleSearch out;
  const int min_count =
      std::max(config.min_points / 2, static_cast<int>(config.min_visible * num_points));
  alignment->set_level(coarsest_level);
  std::vector<Mode> modes = modes_of(scan(config, min_count, alignment));
  if (modes.empty()) return out;
  for (Mode& mode : modes) {
    refine(coarsest_level, alignment, &mode, &out.iterations);
  }
  alignment->set_level(std::min(1, coarsest_level));
  alignment->hide_unmoved(modes[0].sigma, kMinShift);
  for (Mode& mode : modes) mode.score = alignment->correlation(mode.sigma, config.min_points / 4);
  std::stable_sort(modes.begin(), modes.end(),
                   [](const Mode& a, const Mode& b) { return a.score > b.score; });
  out.found = true;
  out.sigma = modes[0].sigma;
  out.ambiguity = ambiguity_of(modes);
  return out;
}

}  // namespace sovo
