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

/// How many points the alignments of a search hold.
struct ScalePointCounts {
  int all, sparse;
};

/// Cold start: correlation over grids of log-scales, whose steps move points by less than a pixel,
/// on a coarse level with all points and on level 1 with the sparse ones (`sparse` holds a part of
/// the points of `alignment`). The best modes of both are refined down to level 1 and compared on
/// the points that can tell scales apart.
ScaleSearch search_scale(const ScaleOptimizerConfig& config, int coarsest_level,
                         const ScalePointCounts& counts, ScaleAlignment* sparse,
                         ScaleAlignment* alignment);

}  // namespace sovo
