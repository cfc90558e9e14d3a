#pragma once

#include "sovo/image/image.h"

namespace sovo {

/// The image at half the resolution: the mean of each 2x2 block; an odd last row or column is cut.
void halve(const ImageF& in, ImageF* out);

/// A mask at a resolution reduced by the whole number `factor`: a pixel may be used (is not 0) when
/// all that it covers may be. An empty mask stays empty.
ImageU8 reduced_mask(const ImageU8& mask, int factor);

/// Where a position in an image that was halved so often lies in the whole image [px].
inline float from_halved(float x, int halvings) {
  return (x + 0.5F) * static_cast<float>(1 << halvings) - 0.5F;
}

/// Where a position of the whole image lies in one that was halved so often [px].
inline float to_halved(float x, int halvings) {
  return (x + 0.5F) / static_cast<float>(1 << halvings) - 0.5F;
}

}  // namespace sovo
