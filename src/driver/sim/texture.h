#pragma once

#include <cstdint>
#include <vector>

#include "sovo/image/image.h"

namespace sovo::sim {

/// A square pattern of side 1 that repeats endlessly, with its means over ever larger blocks, so
/// that it can be looked up at the resolution at which it is seen. Values are in [0, 1].
class Texture {
 public:
  /// `pattern`: square, the side a power of two.
  explicit Texture(const ImageF& pattern);

  /// Texels along the side.
  int size() const { return levels_.front().size; }

  /// Value at (u, v), where one texel of the resolution looked up is 2^level / size() wide;
  /// linear between texels and between levels.
  float sample(double u, double v, float level) const {
    const float fu = fraction(u);
    const float fv = fraction(v);
    if (level <= 0.0F) return bilinear(levels_.front(), fu, fv);
    const int lower = static_cast<int>(level);
    if (lower + 1 >= static_cast<int>(levels_.size())) return mean_;
    const float w = level - static_cast<float>(lower);
    const float fine = bilinear(levels_[static_cast<std::size_t>(lower)], fu, fv);
    const float coarse = bilinear(levels_[static_cast<std::size_t>(lower) + 1], fu, fv);
    return fine + w * (coarse - fine);
  }

  float mean() const { return mean_; }
  int num_levels() const { return static_cast<int>(levels_.size()); }

 private:
  struct Level {
    int size = 0;
    std::vector<std::uint8_t> texels;
  };

  static float fraction(double x) {
    const auto whole = static_cast<std::int64_t>(x);
    const auto f = static_cast<float>(x - static_cast<double>(whole));
    return f < 0.0F ? f + 1.0F : f;
  }

  static float bilinear(const Level& level, float u, float v) {
    const auto size = static_cast<float>(level.size);
    // One tile is added to keep the sum positive, so that truncation is the floor.
    const float x = u * size + (size - 0.5F);
    const float y = v * size + (size - 0.5F);
    const int xi = static_cast<int>(x);
    const int yi = static_cast<int>(y);
    const float fx = x - static_cast<float>(xi);
    const float fy = y - static_cast<float>(yi);
    const int mask = level.size - 1;
    const std::uint8_t* row0 = level.texels.data() + (yi & mask) * level.size;
    const std::uint8_t* row1 = level.texels.data() + ((yi + 1) & mask) * level.size;
    const int x0 = xi & mask;
    const int x1 = (xi + 1) & mask;
    const float a = static_cast<float>(row0[x0]);
    const float b = static_cast<float>(row0[x1]);
    const float c = static_cast<float>(row1[x0]);
    const float d = static_cast<float>(row1[x1]);
    const float top = a + fx * (b - a);
    const float bottom = c + fx * (d - c);
    return (top + fy * (bottom - top)) * (1.0F / 255.0F);
  }

  std::vector<Level> levels_;
  float mean_ = 0.0F;
};

}  // namespace sovo::sim
