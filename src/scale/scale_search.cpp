#include "sovo/scale/scale_search.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace sovo {

namespace {

constexpr double kMinStep = 0.004;  ///< Of the grid: a pixel where points cross half the image.
constexpr double kMaxStep = 0.06;
constexpr int kMaxModes = 4;        ///< Refined, of each level's grid.
constexpr double kSameMode = 0.05;  ///< Minima closer than this are one [log-scale].
constexpr double kMinShift = 2.0;   ///< Of the points that compare modes [px].

struct Mode {
  double sigma = 0.0;
  double score = -1.0;
};

/// Correlation over the whole range on one level.
std::vector<Mode> scan(const ScaleOptimizerConfig& config, int level, int num_points,
                       ScaleAlignment* alignment) {
  alignment->set_level(level);
  const int min_count = std::max(std::min(num_points, config.min_points / 2),
                                 static_cast<int>(config.min_visible * num_points));
  std::vector<Mode> grid;
  double sigma = config.min_log_scale;
  while (sigma <= config.max_log_scale) {
    grid.push_back({sigma, alignment->correlation(sigma, min_count)});
    sigma += std::clamp(1.0 / (1.5 * alignment->mean_shift() + 1e-9), kMinStep, kMaxStep);
  }
  return grid;
}

void sort_by_score(std::vector<Mode>* modes) {
  std::stable_sort(modes->begin(), modes->end(),
                   [](const Mode& a, const Mode& b) { return a.score > b.score; });
}

/// Local maxima, best first; the ends of the range count.
std::vector<Mode> modes_of(const std::vector<Mode>& grid) {
  std::vector<Mode> modes;
  for (std::size_t i = 0; i < grid.size(); ++i) {
    const bool above_left = i == 0 || grid[i].score > grid[i - 1].score;
    const bool above_right = i + 1 == grid.size() || grid[i].score >= grid[i + 1].score;
    if (above_left && above_right && grid[i].score > 0.0) modes.push_back(grid[i]);
  }
  sort_by_score(&modes);
  if (modes.size() > kMaxModes) modes.resize(kMaxModes);
  return modes;
}

/// Gauss-Newton from a mode of the grid.
void refine(int coarsest_level, int finest_level, ScaleAlignment* alignment, Mode* mode,
            int* iterations) {
  alignment->restart();
  double sigma = mode->sigma;
  for (int level = coarsest_level; level >= finest_level; --level) {
    alignment->set_level(level);
    if (!alignment->minimize(1e-3 * (1 << level), &sigma, iterations)) return;
    mode->sigma = sigma;
  }
}

/// How much better the best of sorted modes explains the images than the next that is another.
double ambiguity_of(const std::vector<Mode>& modes) {
  for (std::size_t i = 1; i < modes.size(); ++i) {
    if (std::abs(modes[i].sigma - modes[0].sigma) < kSameMode) continue;
    return std::min(1.0, (1.0 - modes[0].score) / std::max(1e-9, 1.0 - modes[i].score));
  }
  return 0.0;
}

}  // namespace

ScaleSearch search_scale(const ScaleOptimizerConfig& config, int coarsest_level,
                         const ScalePointCounts& counts, ScaleAlignment* sparse,
                         ScaleAlignment* alignment) {
  ScaleSearch out;
  const int finest_level = std::min(1, coarsest_level);
  std::vector<Mode> modes = modes_of(scan(config, coarsest_level, counts.all, alignment));
  for (Mode& mode : modes) refine(coarsest_level, finest_level, alignment, &mode, &out.iterations);
  // Fine texture that repeats is flat on the coarse level: its modes show only here.
  std::vector<Mode> fine = modes_of(scan(config, finest_level, counts.sparse, sparse));
  for (Mode& mode : fine) refine(finest_level, finest_level, alignment, &mode, &out.iterations);
  modes.insert(modes.end(), fine.begin(), fine.end());
  if (modes.empty()) return out;

  alignment->set_level(finest_level);
  sort_by_score(&modes);
  alignment->hide_unmoved(modes[0].sigma, kMinShift);
  for (Mode& mode : modes) mode.score = alignment->correlation(mode.sigma, config.min_points / 4);
  sort_by_score(&modes);
  out.found = true;
  out.sigma = modes[0].sigma;
  out.ambiguity = ambiguity_of(modes);
  return out;
}

}  // namespace sovo
