#pragma once

#include "sovo/image/image.h"

namespace sovo {

/// Value and gradient of an image at a sub-pixel position [grey levels, grey levels / px].
struct Sample {
  float value, gx, gy;
};

/// Bilinear interpolation of the image. Needs 0 <= x < width - 1 and 0 <= y < height - 1.
inline float sample(const ImageF& image, float x, float y) {
  const int ix = static_cast<int>(x);
  const int iy = static_cast<int>(y);
  const float fx = x - static_cast<float>(ix);
  const float fy = y - static_cast<float>(iy);
  const float* r0 = image.row(iy) + ix;
  const float* r1 = r0 + image.width();
  const float top = r0[0] + fx * (r0[1] - r0[0]);
  const float bottom = r1[0] + fx * (r1[1] - r1[0]);
  return top + fy * (bottom - top);
}

/// Bilinear interpolation of the image and of its central differences, from the 4x4 pixels around
/// the position: no gradient image is stored. Needs 1 <= x < width - 2 and 1 <= y < height - 2.
inline Sample sample_with_gradient(const ImageF& image, float x, float y) {
  const int ix = static_cast<int>(x);
  const int iy = static_cast<int>(y);
  const float fx = x - static_cast<float>(ix);
  const float fy = y - static_cast<float>(iy);
  const int w = image.width();
  const float* r1 = image.row(iy) + ix - 1;  // rows iy-1 .. iy+2, columns ix-1 .. ix+2
  const float* r0 = r1 - w;
  const float* r2 = r1 + w;
  const float* r3 = r2 + w;
  float blended[4];
  for (int i = 0; i < 4; ++i) blended[i] = r1[i] + fy * (r2[i] - r1[i]);
  float vertical[2];
  for (int i = 0; i < 2; ++i) {
    const float upper = r2[i + 1] - r0[i + 1];
    const float lower = r3[i + 1] - r1[i + 1];
    vertical[i] = upper + fy * (lower - upper);
  }
  const float left = blended[2] - blended[0];
  const float right = blended[3] - blended[1];
  return {blended[1] + fx * (blended[2] - blended[1]), 0.5F * (left + fx * (right - left)),
          0.5F * (vertical[0] + fx * (vertical[1] - vertical[0]))};
}

/// Whether `sample_with_gradient` may read at (x, y), with `border` more pixels of margin.
inline bool in_image(const ImageF& image, float x, float y, float border = 0.0F) {
  return x >= 1.0F + border && y >= 1.0F + border &&
         x < static_cast<float>(image.width() - 2) - border &&
         y < static_cast<float>(image.height() - 2) - border;
}

}  // namespace sovo
