#pragma once

#include "sovo/image/image.h"

namespace sovo {

/// How alike a square of two images is.
struct Likeness {
  double correlation = 1.0;  ///< Pearson's; 1 where either does not vary.
  double difference = 0.0;   ///< RMS, but for its mean [grey levels].
  double contrast = 0.0;     ///< Standard deviation, the larger of the two [grey levels].

  bool is_same() const { return correlation > 0.8; }
  /// More than by noise, of which `rmse` is the measure: residuals of what is as expected
  /// [grey levels].
  bool is_different(double rmse) const { return correlation < 0.5 && difference > 1.5 * rmse; }
};

/// Of the squares of `side` px with their upper left corner at (x0, y0), by every second pixel;
/// what lies beyond the images does not count.
Likeness likeness(const ImageF& a, const ImageF& b, int x0, int y0, int side);

}  // namespace sovo
