#pragma once

#include <array>
#include <cstddef>

namespace sovo {

/// The residual pattern: eight pixels around a point, none of which lies in its middle. That of DSO
/// (fig. 4) lacks one of nine at a side. On the ground, whose depth changes from pixel to pixel,
/// its depth is that of another place than the point's, and a motion estimated from it is bent.
inline constexpr int kPatternSize = 8;
inline constexpr int kPatternBorder = 3;  ///< Farthest offset, and one more for the gradient.

struct PatternOffset {
  float x, y;
};
inline constexpr std::array<PatternOffset, kPatternSize> kPattern = {
    {{0, -2}, {-1, -1}, {1, -1}, {-2, 0}, {2, 0}, {-1, 1}, {1, 1}, {0, 2}}};
inline constexpr std::size_t kPatternLeft = 3;  ///< The leftmost pixel, in the middle row.

/// Most keyframes a window holds while one enters and before one leaves.
inline constexpr int kMaxSlots = 9;

}  // namespace sovo
