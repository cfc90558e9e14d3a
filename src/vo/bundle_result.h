#pragma once

#include <limits>
#include <optional>

#include "sovo/geometry/types.h"
#include "sovo/vo/lens_fit.h"

namespace sovo {

/// What bundle adjustment of a window came to.
struct BundleResult {
  double rmse = 0.0;  ///< Of the residuals, an outlier counting its threshold [grey levels].
  int iterations = 0;
  int points = 0;
  int residuals = 0;
  bool finite = true;  ///< False: the solve broke down; the window must be thrown away.
  /// Covariance of the newest keyframe's pose as seen from the keyframe before it (left
  /// perturbation of T_newest_before: translation [the window's unit], rotation [rad]), the
  /// window's scale held. Of two keyframes or more.
  Mat6 newest_covariance = Mat6::Zero();
  /// Of a common factor of all depths, by the static residuals; infinite without any.
  double scale_variance = std::numeric_limits<double>::infinity();
  /// By how much that factor's logarithm changes where all right images are displaced by a pixel
  /// along their epipolar lines and the depths keep their proportions (absolute value); 0 where
  /// static residuals do not hold the scale.
  double scale_per_px = 0.0;
  double gradient_scatter = 1.0;  ///< Of the residuals into the newest keyframe.
  /// Where it was asked for, and the window tells something.
  std::optional<LensEvidence> lens;
};

}  // namespace sovo
