#pragma once

#include <cstdint>

#include "sovo/image/image.h"

namespace sovo::sim {

/// Noise that repeats beyond its edges: `octaves` of smoothly interpolated random values, the first
/// on `cells` x `cells`, each following one twice as fine and `persistence` times as strong. About
/// a mean of 1/2 with a standard deviation of about 0.2. Sizes are powers of two.
ImageF noise_pattern(int size, int cells, int octaves, float persistence, std::uint64_t seed);

/// Bright lines between the cells of `points` random points, as light draws them below waves: 1 on
/// the lines, falling to 0 within the cells. Repeats beyond its edges.
ImageF caustic_pattern(int size, int points, std::uint64_t seed);

}  // namespace sovo::sim
