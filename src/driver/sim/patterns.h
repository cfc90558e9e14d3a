#pragma once

#include <cstdint>

#include "sovo/image/image.h"

namespace sovo::sim {

// Patterns that worlds are papered with: square, repeating beyond their edges, values in [0, 1] of
// reflected light. Every one has detail down to its texels.

ImageF grass_pattern(int size, std::uint64_t seed);
ImageF asphalt_pattern(int size, std::uint64_t seed);
ImageF paving_pattern(int size, int slabs, std::uint64_t seed);
/// `rows` of bricks, half as many columns, every other row shifted.
ImageF brick_pattern(int size, int rows, std::uint64_t seed);
/// Glazed tiles, `tiles` along the side, every one of its own shade.
ImageF tile_pattern(int size, int tiles, std::uint64_t seed);
/// A storey's cell of a house: two windows in a wall; `style` chooses wall and windows.
ImageF facade_pattern(int size, int style, std::uint64_t seed);
/// Panels with rivets, vents, gauges, pipes and signs, as machines have them.
ImageF machine_pattern(int size, std::uint64_t seed);
/// A wooden crate's side: boards and a frame.
ImageF crate_pattern(int size, std::uint64_t seed);
/// Stains and scratches on concrete.
ImageF concrete_pattern(int size, std::uint64_t seed);
/// The side of a car, its front to the right; the wheels stand at the lower edge (v = 1).
ImageF car_pattern(int size, std::uint64_t seed);
ImageF cloud_pattern(int size, std::uint64_t seed);

/// Something with holes: reflected light, and the share of each texel that is covered.
struct Cutout {
  ImageF value;
  ImageF opacity;
};
/// A bunch of leaves; nothing at the edges.
Cutout leaf_cutout(int size, int leaves, double leaf_length, std::uint64_t seed);
/// A tuft of blades that grows from the lower edge (v = 1); nothing at the other edges.
Cutout tuft_cutout(int size, int blades, std::uint64_t seed);
/// A soft spot: opacity 1 in the middle, 0 at the edges, frayed by noise of strength `fray`.
Cutout spot_cutout(int size, double softness, double fray, std::uint64_t seed);

}  // namespace sovo::sim
