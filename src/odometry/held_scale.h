#pragma once

#include <limits>

#include "sovo/scale/scale_optimizer.h"
#include "sovo/vo/bundle_result.h"

namespace sovo {

/// What static residuals know of the scale of a window that they hold.
struct HeldScale {
  double variance = std::numeric_limits<double>::infinity();  ///< Of log-scale.

  /// Whether that is as good as a measurement: what scale optimization did not find since it saw
  /// too little is known all the same. Of points that this scale puts outside the right image, or
  /// without such an image, nothing is.
  bool stands_in_for(const ScaleEstimate& estimate, const ScaleOptimizerConfig& config) const {
    const bool sees_little = estimate.verdict == ScaleVerdict::kTooFewPoints ||
                             estimate.verdict == ScaleVerdict::kUnobservable;
    return sees_little && !estimate.out_of_view &&
           variance <= config.max_sigma_tracking * config.max_sigma_tracking;
  }
};

/// Of noise, and of what displaces whole images: no calibration fits to better than some
/// hundredths of a pixel, and a disparity of few pixels makes much of that.
inline HeldScale held_scale(const BundleResult& bundle, const ScaleOptimizerConfig& config) {
  constexpr double kDisplacement = 0.05;  // [px]
  const double displaced = kDisplacement * bundle.scale_per_px;
  return {bundle.scale_variance + displaced * displaced + config.sigma_floor * config.sigma_floor};
}

}  // namespace sovo
