#pragma once

#include <cstdint>
#include <vector>

#include "sovo/image/image.h"

namespace sovo::sim {

/// A place on an endlessly repeated pattern, as fractions of its side in units of 2^-32: whole
/// repetitions vanish by themselves.
struct TexturePlace {
  std::uint32_t u = 0;
  std::uint32_t v = 0;
};

/// `x` sides as a fraction of the pattern's side. Precondition: |x| < 2^30.
inline std::uint32_t texture_fraction(double x) {
  return static_cast<std::uint32_t>(static_cast<std::int64_t>(x * 4294967296.0));
}

/// A square pattern of side 1 that repeats endlessly, with its means over ever larger blocks, so
/// that it can be looked up at the resolution at which it is seen. Values are in [0, 1].
class Texture {
 public:
  /// `pattern`: square, the side a power of two.
  explicit Texture(const ImageF& pattern);

  /// Texels along the side.
  int size() const { return 1 << (num_levels() - 1); }
  int num_levels() const { return static_cast<int>(levels_.size()); }
  float mean() const { return mean_; }

  /// Value where one texel of the resolution looked up is 2^level / size() wide; linear between
  /// texels (in steps of 1/256 of them) and between levels.
  float sample(TexturePlace place, float level) const {
    constexpr float kScale = 1.0F / (255.0F * 65536.0F);
    if (level <= 0.0F) return kScale * static_cast<float>(bilinear(0, place));
    const int lower = static_cast<int>(level);
    if (lower + 1 >= num_levels()) return mean_;
    const float w = level - static_cast<float>(lower);
    const auto fine = static_cast<float>(bilinear(lower, place));
    const auto coarse = static_cast<float>(bilinear(lower + 1, place));
    return kScale * (fine + w * (coarse - fine));
  }

  /// As above, at fractions of the side.
  float sample(double u, double v, float level) const {
    return sample(TexturePlace{texture_fraction(u), texture_fraction(v)}, level);
  }

 private:
  struct Level {
    std::uint32_t size = 1;
    std::uint32_t half_texel = 0;  ///< In units of `TexturePlace`.
    /// Every entry has the texel, its right neighbour, and the two below them, in this order from
    /// the lowest byte on.
    std::vector<std::uint32_t> quads;
  };

  /// 255 * 65536 times the value.
  int bilinear(int level, TexturePlace place) const {
    const Level& l = levels_[static_cast<std::size_t>(level)];
    // Texel centres are at half texels. The upper words are the texel, what follows the place in
    // it.
    const std::uint64_t u = std::uint64_t{place.u - l.half_texel} * l.size;
    const std::uint64_t v = std::uint64_t{place.v - l.half_texel} * l.size;
    const std::uint32_t fu = static_cast<std::uint32_t>(u) >> 24;
    const std::uint32_t fv = static_cast<std::uint32_t>(v) >> 24;
    const std::uint32_t quad = l.quads[(v >> 32) * l.size + (u >> 32)];
    // The upper and the lower pair at once, in the two halves of a word.
    const std::uint32_t left = quad & 0x00FF00FFU;
    const std::uint32_t right = quad >> 8 & 0x00FF00FFU;
    const std::uint32_t rows = left * (256U - fu) + right * fu;
    return static_cast<int>((rows & 0xFFFFU) * (256U - fv) + (rows >> 16) * fv);
  }

  std::vector<Level> levels_;  ///< From the finest to one texel.
  float mean_ = 0.0F;
};

}  // namespace sovo::sim
