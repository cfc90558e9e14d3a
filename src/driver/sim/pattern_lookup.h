#pragma once

#include <array>

#include "sovo/driver/sim/spots.h"
#include "sovo/driver/sim/texture.h"

namespace sovo::sim {

/// Patterns are looked up a little softer than pixels are, as a lens does [levels].
inline constexpr float kLevelBias = 0.25F;

/// Coordinates of a batch of spots: on their surface or in the world [m].
struct SpotPlaces {
  double foot_x = 0.0, foot_y = 0.0;  ///< x and y count from here.
  const BatchFloats* x = nullptr;
  const BatchFloats* y = nullptr;
  const BatchFloats* long_x = nullptr;
  const BatchFloats* long_y = nullptr;
};

/// How a pattern lies: (u, v) = map * (x, y) + shift, in its sides.
struct PatternMap {
  std::array<double, 4> map{1.0, 0.0, 0.0, 1.0};
  std::array<double, 2> shift{0.0, 0.0};
  float log_texels = 0.0F;  ///< log2 of texels per metre.
};

/// Means of a pattern over spots: lookups along their long diameters, each as wide as the short
/// one.
void look_up(const Texture& texture, const PatternMap& map, const SpotPlaces& places,
             const Spots& spots, BatchFloats* result);

}  // namespace sovo::sim
