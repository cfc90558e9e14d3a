#pragma once

#include "sovo/scale/scale_alignment.h"

namespace sovo {

/// Outcome of a search over the whole range of log-scale.
struct ScaleSearch {
  bool found = false;  ///< False: at no scale are enough points in view.
  double sigma = 0.0;  ///< Log-scale of the best minimum, refined on the level above the finest.
  double ambiguity = 0.0;  ///< (1 - best) / (1 - second) of the correlations; 0 without a second.
  int iterations = 0;
};

/// Cold start: correlation over a grid of log-scales on a coarse level, with steps that move points
/// by less than a pixel there; the best modes are then refined down to level 1 and compared on the
/// points that can tell scales apart.
ScaleSearch search_scale(const ScaleOptimizerConfig& config, int num_points, int coarsest_level,
                         ScaleAlignment* alignment);

}  // namespace sovo
