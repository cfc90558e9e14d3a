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
void append_quads(const ImageF& image, std::vector<std::uint32_t>* quads) {
  const int size = image.width();
  const auto texel = [&](int x, int y) {
    const float value = std::clamp(image.at(x & (size - 1), y & (size - 1)), 0.0F, 1.0F);
    return static_cast<std::uint32_t>(value * 255.0F + 0.5F);
  };
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      quads->push_back(texel(x, y) | texel(x + 1, y) << 8 | texel(x, y + 1) << 16 |
                       texel(x + 1, y + 1) << 24);
    }
  }
}

}  // namespace

Texture::Texture(const ImageF& pattern) {
  std::vector<ImageF> levels{pattern};
  while (levels.back().width() > 1) levels.push_back(halved(levels.back()));
  log_size_ = static_cast<int>(levels.size()) - 1;
  mean_ = std::clamp(levels.back().at(0, 0), 0.0F, 1.0F);
  levels.pop_back();
  quads_.reserve(2 * pattern.size());
  std::reverse(levels.begin(), levels.end());
  for (const ImageF& level : levels) append_quads(level, &quads_);
  quads_.shrink_to_fit();
}

}  // namespace sovo::sim
