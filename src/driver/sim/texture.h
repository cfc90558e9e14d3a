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
  /// `pattern`: square, the side a power of two and at least 4.
  explicit Texture(const ImageF& pattern);

  /// Texels along the side.
  int size() const { return 1 << log_size_; }
  int log_size() const { return log_size_; }
  float mean() const { return mean_; }

  /// Value where one texel of the resolution looked up is 2^level / size() wide; linear between
  /// texels (in steps of 1/256 of them) and between levels.
  float sample(TexturePlace place, float level) const {
    if (level <= 0.0F) return kScale * texel(quads(), log_size_, place);
    const int lower = static_cast<int>(level);
    if (lower >= log_size_) return mean_;
    const float w = level - static_cast<float>(lower);
    const float fine = kScale * texel(quads(), log_size_ - lower, place);
    const bool last = lower + 1 == log_size_;
    const float coarse = last ? mean_ : kScale * texel(quads(), log_size_ - lower - 1, place);
    return fine + w * (coarse - fine);
  }

  /// As above, at fractions of the side.
  float sample(double u, double v, float level) const {
    return sample(TexturePlace{texture_fraction(u), texture_fraction(v)}, level);
  }

  /// All levels of at least 2 x 2 texels, the coarsest first. Every entry has a texel, its right
  /// neighbour, and the two below them, in this order from the lowest byte on.
  const std::uint32_t* quads() const { return quads_.data(); }

  /// `1 / kScale` times the value in the level of 2^log_side texels a side, 1 <= log_side.
  static float texel(const std::uint32_t* quads, int log_side, TexturePlace place) {
    const auto side = static_cast<std::uint32_t>(log_side);
    // Texel centres are at half texels. The upper bits are the texel, what follows the place in
    // it.
    const std::uint32_t u = place.u - (0x80000000U >> side);
    const std::uint32_t v = place.v - (0x80000000U >> side);
    const std::uint32_t fu = (u << side) >> 24;
    const std::uint32_t fv = (v << side) >> 24;
    const std::uint32_t quad =
        quads[first_of(side) + ((v >> (32U - side)) << side) + (u >> (32U - side))];
    // The upper and the lower pair at once, in the two halves of a word.
    const std::uint32_t left = quad & 0x00FF00FFU;
    const std::uint32_t right = quad >> 8 & 0x00FF00FFU;
    const std::uint32_t rows = left * (256U - fu) + right * fu;
    const std::uint32_t sum = (rows & 0xFFFFU) * (256U - fv) + (rows >> 16) * fv;
    return static_cast<float>(static_cast<std::int32_t>(sum));
  }
  static constexpr float kScale = 1.0F / (255.0F * 65536.0F);

 private:
  /// Texels of all coarser levels: 4 + 16 + ... + 4^(log_side - 1).
  static std::uint32_t first_of(std::uint32_t log_side) {
    return (0x55555555U >> (32U - 2U * log_side)) - 1U;
  }

  std::vector<std::uint32_t> quads_;
  int log_size_ = 0;
  float mean_ = 0.0F;
};

}  // namespace sovo::sim
