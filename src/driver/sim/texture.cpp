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

}  // namespace

Texture::Texture(const ImageF& pattern) {
  ImageF image = pattern;
  while (true) {
    Level level;
    level.size = image.width();
    level.texels.reserve(image.size());
    for (std::size_t i = 0; i < image.size(); ++i) {
      const float value = std::clamp(image.data()[i], 0.0F, 1.0F);
      level.texels.push_back(static_cast<std::uint8_t>(value * 255.0F + 0.5F));
    }
    levels_.push_back(std::move(level));
    if (image.width() == 1) break;
    image = halved(image);
  }
  mean_ = std::clamp(image.at(0, 0), 0.0F, 1.0F);
}

}  // namespace sovo::sim
