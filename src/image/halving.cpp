#include "sovo/image/halving.h"

#include <algorithm>
#include <cstdint>

namespace sovo {

void halve(const ImageF& in, ImageF* out) {
  out->resize(in.width() / 2, in.height() / 2);
  for (int y = 0; y < out->height(); ++y) {
    const float* a = in.row(2 * y);
    const float* b = in.row(2 * y + 1);
    float* o = out->row(y);
    for (int x = 0; x < out->width(); ++x) {
      o[x] = 0.25F * (a[2 * x] + a[2 * x + 1] + b[2 * x] + b[2 * x + 1]);
    }
  }
}

ImageU8 reduced_mask(const ImageU8& mask, int factor) {
  if (mask.empty() || factor == 1) return mask;
  ImageU8 out(mask.width() / factor, mask.height() / factor);
  for (int y = 0; y < out.height(); ++y) {
    for (int x = 0; x < out.width(); ++x) {
      std::uint8_t least = 255;
      for (int j = 0; j < factor; ++j) {
        for (int i = 0; i < factor; ++i) {
          least = std::min(least, mask.at(x * factor + i, y * factor + j));
        }
      }
      out.at(x, y) = least;
    }
  }
  return out;
}

}  // namespace sovo
