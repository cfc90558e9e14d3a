#pragma once

#include <array>
#include <vector>

#include "sovo/vo/coarse_tracker.h"
#include "sovo/vo/pattern.h"
#include "sovo/vo/tracking_reference.h"

namespace sovo {

/// What is known of the light that a reference and an image were seen by.
struct KnownLight {
  BrightnessTransfer transfer;  ///< Reference to image.
  /// Whether nothing else changes brightness. A vignette that is not known yet darkens all that
  /// moves to the edge of the image, and so speaks for a camera at rest.
  bool is_all = true;
};

/// The patterns around a reference's points, to tell how well an image fits a pose.
class ReferencePatterns {
 public:
  using Values = std::array<float, kPatternSize>;  ///< Grey levels of a pattern.

  /// Of the points of level 0 whose patterns lie in `image`, the reference's own. Precondition: the
  /// points are pixels of it.
  ReferencePatterns(const ReferenceLevel& points, const ImageF& image);

  /// What an image that sees the patterns where a pose puts them leaves unexplained: the root of
  /// the mean robust squared residual [grey levels], over the share of the variance that is
  /// explained. Those residuals alone hardly tell a wrong place from the right one: what does not
  /// agree there counts no more than the cutoff. Where the light is not all known, the geometric
  /// mean of that and of the same for patterns less their means, to which it does little.
  double unexplained(const ImageF& image, const SE3& T_current_reference, const KnownLight& light,
                     const RobustNorm& norm) const;

 private:
  struct Pattern {
    float u, v, rho;
    Values values;
  };
  /// What an image shows where a pattern should be; false where that leaves it.
  static bool take(const Pattern& pattern, const ImageF& image, const Eigen::Matrix3f& KRKi,
                   const Eigen::Vector3f& Kt, Values* seen);

  CameraModel camera_;
  std::vector<Pattern> patterns_;
};

}  // namespace sovo
