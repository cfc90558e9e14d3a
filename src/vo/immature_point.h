#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "sovo/vo/pattern.h"
#include "sovo/vo/surface_slope.h"

namespace sovo {

/// Verdict of the newest epipolar search of a point.
enum class TraceState : std::uint8_t {
  kUntraced,
  kGood,
  kSkipped,       ///< The interval is already narrow.
  kBadCondition,  ///< The gradient along the line cannot improve the interval.
  kOutlier,
  kOutOfView,  ///< Final.
};

/// A candidate point of a keyframe whose inverse depth is an interval that epipolar searches in
/// following images narrow.
struct ImmaturePoint {
  float u = 0.0F, v = 0.0F;  ///< In the host's level 0 [px].
  std::uint8_t type = 1;     ///< Block size of the selection: 1, 2, 4.
  std::array<float, kPatternSize> colour{};
  std::array<float, kPatternSize> weight{};
  ColourBlur blur;
  float gxx = 0.0F, gxy = 0.0F, gyy = 0.0F;  ///< Sum of gradient products over the pattern.
  float energy_threshold = 0.0F;             ///< Of the whole pattern.
  float rho_min = 0.0F;                      ///< [1/m]
  float rho_max = std::numeric_limits<float>::quiet_NaN();  ///< NaN: unknown, search from infinity.
  float quality = 10000.0F;                                 ///< Second-best over best energy.
  float interval_px = 0.0F;                                 ///< Length of the newest search.
  TraceState state = TraceState::kUntraced;
  /// On rho, of the stereo match that gave the interval, as `Point::static_information`; 0: there
  /// was none [m^2].
  float static_information = 0.0F;
  SurfaceSlope slope;  ///< Of what it lies on; (0, 0): not known.

  bool from_static_match() const { return static_information > 0.0F; }
};

/// Whether a static match tells a depth well enough to use it as it is: to about 15 %.
/// `static_information`: on the inverse depth `rho`.
inline bool knows_depth(double static_information, double rho) {
  constexpr double kLeastInformation = 1000.0;  // on log-depth
  return static_information * rho * rho >= kLeastInformation;
}

}  // namespace sovo
