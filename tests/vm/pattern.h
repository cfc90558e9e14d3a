#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>

namespace sovo::test {

// Side-by-side images that tell which they are: the first row of each half spells frame number and
// side in 33 bits, black and white; every other row has one grey level that follows from number,
// side and row. Two frames mixed, a row lost or a half exchanged shows.

inline constexpr int kPatternBits = 32;

inline std::uint8_t pattern_level(std::uint32_t number, bool right, int y) {
  return static_cast<std::uint8_t>(number * 37U + static_cast<unsigned>(y) * 5U +
                                   (right ? 128U : 0U));
}

inline std::uint8_t pattern_bit(std::uint32_t number, bool right, int x) {
  if (x < kPatternBits) return ((number >> x) & 1U) != 0 ? 235 : 16;
  return x == kPatternBits && right ? 235 : 16;
}

/// Draws one side as YUYV; `stride`: bytes from a row to the next. Precondition: wider than 33
/// pixels.
inline void draw_side(std::uint32_t number, bool right, int width, int height, std::size_t stride,
                      std::uint8_t* yuyv) {
  for (int y = 0; y < height; ++y) {
    std::uint8_t* row = yuyv + stride * static_cast<std::size_t>(y);
    const std::uint8_t level = pattern_level(number, right, y);
    const std::uint8_t pixel[4] = {level, 128, level, 128};
    for (int x = 0; x < width; x += 2) std::memcpy(row + 2 * x, pixel, 4);
    for (int x = 0; y == 0 && x < width; ++x) row[2 * x] = pattern_bit(number, right, x);
  }
}

/// Draws both sides beside each other, width * height * 2 bytes.
inline void draw_pattern(std::uint32_t number, int width, int height, std::uint8_t* yuyv) {
  const auto stride = 2 * static_cast<std::size_t>(width);
  draw_side(number, false, width / 2, height, stride, yuyv);
  draw_side(number, true, width / 2, height, stride, yuyv + width);
}

/// The number of a half image; nothing when it is not whole, or of the other side.
inline std::optional<std::uint32_t> read_pattern(const std::uint8_t* luma, int width, int height,
                                                 bool right) {
  std::uint32_t number = 0;
  for (int x = 0; x < kPatternBits; ++x) number |= (luma[x] > 128 ? 1U : 0U) << x;
  for (int x = 0; x < width; ++x) {
    if (luma[x] != pattern_bit(number, right, x)) return std::nullopt;
  }
  for (int y = 1; y < height; ++y) {
    const std::uint8_t* row = luma + static_cast<std::size_t>(y) * width;
    // All bytes of the row are equal to the first, which is right.
    if (row[0] != pattern_level(number, right, y)) return std::nullopt;
    if (std::memcmp(row, row + 1, static_cast<std::size_t>(width) - 1) != 0) return std::nullopt;
  }
  return number;
}

}  // namespace sovo::test
