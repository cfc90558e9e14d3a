#pragma once

#include <array>

namespace sovo {

/// The residual pattern: eight pixels spread around a point (DSO, fig. 4, the ninth left out).
inline constexpr int kPatternSize = 8;
inline constexpr int kPatternBorder = 3;  ///< Farthest offset, and one more for the gradient.

struct PatternOffset {
  float x, y;
};
inline constexpr std::array<PatternOffset, kPatternSize> kPattern = {
    {{0, -2}, {-1, -1}, {1, -1}, {-2, 0}, {0, 0}, {2, 0}, {-1, 1}, {0, 2}}};
inline constexpr int kPatternCentre = 4;

/// Most keyframes a window holds while one enters and before one leaves.
inline constexpr int kMaxSlots = 9;

}  // namespace sovo
