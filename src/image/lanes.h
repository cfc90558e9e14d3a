#pragma once

#include <cstddef>

#include "sovo/image/image.h"

namespace sovo {

/// Four floats that the compiler keeps in one register (SSE, NEON): GCC's vector extension, so
/// that one source serves every machine and each lane computes exactly what scalar code would.
using Lane = float __attribute__((vector_size(16)));
inline constexpr std::size_t kLanes = 4;

inline Lane load_lane(const float* p) {
  Lane v;
  __builtin_memcpy(&v, p, sizeof(v));
  return v;
}
inline void store_lane(Lane v, float* p) { __builtin_memcpy(p, &v, sizeof(v)); }
inline Lane lane_of(float x) { return Lane{x, x, x, x}; }
/// Sum in a fixed order.
inline float sum_lane(Lane v) { return (v[0] + v[1]) + (v[2] + v[3]); }

/// Rows become columns.
inline void transpose(Lane* a, Lane* b, Lane* c, Lane* d) {
  const Lane ab_low = __builtin_shufflevector(*a, *b, 0, 4, 1, 5);
  const Lane ab_high = __builtin_shufflevector(*a, *b, 2, 6, 3, 7);
  const Lane cd_low = __builtin_shufflevector(*c, *d, 0, 4, 1, 5);
  const Lane cd_high = __builtin_shufflevector(*c, *d, 2, 6, 3, 7);
  *a = __builtin_shufflevector(ab_low, cd_low, 0, 1, 4, 5);
  *b = __builtin_shufflevector(ab_low, cd_low, 2, 3, 6, 7);
  *c = __builtin_shufflevector(ab_high, cd_high, 0, 1, 4, 5);
  *d = __builtin_shufflevector(ab_high, cd_high, 2, 3, 6, 7);
}

/// Values and gradients of an image at four positions [grey levels, grey levels / px].
struct LaneSample {
  Lane value, gx, gy;
};

/// `sample_with_gradient` at four positions at once, bit for bit the same. All four must satisfy
/// its precondition.
inline LaneSample sample_lanes_with_gradient(const ImageF& image, const float* x, const float* y) {
  Lane blended[kLanes];
  Lane vertical[kLanes];
  Lane fx;
  const int w = image.width();
  for (std::size_t i = 0; i < kLanes; ++i) {
    const int ix = static_cast<int>(x[i]);
    const int iy = static_cast<int>(y[i]);
    fx[i] = x[i] - static_cast<float>(ix);
    const Lane fy = lane_of(y[i] - static_cast<float>(iy));
    const float* row = image.row(iy) + ix - 1;
    const Lane r0 = load_lane(row - w);
    const Lane r1 = load_lane(row);
    const Lane r2 = load_lane(row + w);
    const Lane r3 = load_lane(row + 2 * static_cast<std::ptrdiff_t>(w));
    blended[i] = r1 + fy * (r2 - r1);
    const Lane upper = r2 - r0;
    const Lane lower = r3 - r1;
    vertical[i] = upper + fy * (lower - upper);
  }
  transpose(&blended[0], &blended[1], &blended[2], &blended[3]);
  transpose(&vertical[0], &vertical[1], &vertical[2], &vertical[3]);
  const Lane half = lane_of(0.5F);
  const Lane left = blended[2] - blended[0];
  const Lane right = blended[3] - blended[1];
  return {blended[1] + fx * (blended[2] - blended[1]), half * (left + fx * (right - left)),
          half * (vertical[1] + fx * (vertical[2] - vertical[1]))};
}

}  // namespace sovo
