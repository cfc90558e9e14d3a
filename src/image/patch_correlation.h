#pragma once

#include <array>
#include <limits>
#include <optional>

#include "sovo/geometry/types.h"
#include "sovo/image/epipolar_curve.h"
#include "sovo/image/pyramid.h"

namespace sovo {

/// Patches are aligned with the epipolar curve: 7 pixels along it, 5 across.
inline constexpr int kPatchAlong = 7;
inline constexpr int kPatchAcross = 5;
inline constexpr int kPatchSize = kPatchAlong * kPatchAcross;

/// A pixel of the base image that is looked for in the target image.
struct PatchSearch {
  const ImagePyramid* base;
  const ImagePyramid* target;
  Vec2 pixel;  ///< In the base image, level 0.
  EpipolarCurve curve;
};

/// Correlation along a piece of the curve, in steps of about one pixel of the level searched.
struct CorrelationProfile {
  static constexpr int kCapacity = 700;
  static constexpr float kUnseen = -2.0F;  ///< Score where the patch leaves an image.

  int size = 0;
  std::array<float, kCapacity + 8> score;  ///< Written eight at a time at most.
  std::array<float, kCapacity> rho;        ///< Inverse depth of each step.

  float step_rho(int i) const {
    return i + 1 < size ? rho[i + 1] - rho[i] : (i > 0 ? rho[i] - rho[i - 1] : 0.0F);
  }
  /// Index of the highest score; -1 when nothing was seen.
  int best() const;
  /// Highest local maximum farther than `distance` steps from `from`; -1 when there is none.
  int best_other_mode(int from, int distance) const;
  /// Vertex of the parabola through step i and its neighbours: inverse depth.
  float refined_rho(int i) const;
};

/// ZNCC of the base patch with the target along the curve from `rho_min` to `rho_max`. False when
/// the patch around the base pixel does not fit into the base image at this level.
bool correlate(const PatchSearch& search, int level, double rho_min, double rho_max,
               CorrelationProfile* profile);

/// Result of the sub-pixel alignment at level 0.
struct Alignment {
  double rho = 0.0;
  double zncc = 0.0;
  double sigma_px = 0.0;    ///< Standard deviation along the curve [px].
  double px_per_rho = 0.0;  ///< Speed along the curve [px m].
  double across_px = 0.0;   ///< Displacement that fits best across the curve [px].
  /// Its standard deviation; infinite when not observable, or not measured.
  double across_sigma_px = std::numeric_limits<double>::infinity();
  Vec2 pixel = Vec2::Zero();  ///< In the target image, level 0.
};

/// Rms gradient along the curve of the base patch at level 0 [grey levels / px]; nothing when the
/// patch does not fit into the image.
std::optional<double> gradient_along(const PatchSearch& search, double rho);

/// Gauss-Newton on displacement along the curve, gain and bias, from `rho`; then, if asked for,
/// the displacement across it. Nothing when a patch leaves its image.
std::optional<Alignment> align(const PatchSearch& search, double rho, bool measure_across);

}  // namespace sovo
