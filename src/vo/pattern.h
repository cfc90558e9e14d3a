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

/// Variances of a narrow and a wide blur [px^2].
inline constexpr float kNarrowBlur = 0.5F;
inline constexpr float kWideBlur = 2.0F;

/// What blur along the axes of its image adds to a pattern's colours [grey levels]: narrow blur,
/// and wide blur beyond the narrow one.
struct ColourBlur {
  std::array<float, kPatternSize> narrow_u{}, narrow_v{}, wide_u{}, wide_v{};
};

/// Most keyframes a window holds while one enters and before one leaves.
inline constexpr int kMaxSlots = 9;

}  // namespace sovo
