#include "sovo/driver/sim/texture.h"

#include <algorithm>

namespace sovo::sim {
namespace {

ImageF halved(const ImageF& image) {
  ImageF half(image.width() / 2, image.height() / 2);
  for (int y = 0; y < half.height(); ++y) {
    const float* upper = image.row(2 * y);
    const float* lower = image.row(2 * y + 1);
    for (int x = 0; x < half.width(); ++x) {
      half.at(x, y) = 0.25F * (upper[2 * x] + upper[2 * x + 1] + lower[2 * x] + lower[2 * x + 1]);
    }
  }
  return half;
}

/// Every texel with its neighbours to the right and below; beyond the edge the pattern repeats.
std::vector<std::uint32_t> quads(const ImageF& image) {
  const int size = image.width();
  const auto texel = [&](int x, int y) {
    const float value = std::clamp(image.at(x & (size - 1), y & (size - 1)), 0.0F, 1.0F);
    return static_cast<std::uint32_t>(value * 255.0F + 0.5F);
  };
  std::vector<std::uint32_t> result;
  result.reserve(image.size());
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      result.push_back(texel(x, y) | texel(x + 1, y) << 8 | texel(x, y + 1) << 16 |
                       texel(x + 1, y + 1) << 24);
    }
  }
  return result;
}

}  // namespace

Texture::Texture(const ImageF& pattern) {
  ImageF image = pattern;
  while (true) {
    const auto size = static_cast<std::uint32_t>(image.width());
    const auto half = static_cast<std::uint32_t>((std::uint64_t{1} << 31) / size);
    levels_.push_back({size, half, quads(image)});
    if (size == 1) break;
    image = halved(image);
  }
  mean_ = std::clamp(image.at(0, 0), 0.0F, 1.0F);
}

}  // namespace sovo::sim
