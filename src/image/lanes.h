#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#if defined(__SSE__)
#include <xmmintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

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
/// Four whole numbers; as the result of a comparison -1 where it holds, else 0.
using LaneMask = std::int32_t __attribute__((vector_size(16)));

/// Whether a comparison holds in all four lanes.
inline bool all_of(LaneMask mask) { return (mask[0] & mask[1] & mask[2] & mask[3]) != 0; }
/// Whether it holds in none.
inline bool none_of(LaneMask mask) { return (mask[0] | mask[1] | mask[2] | mask[3]) == 0; }
/// The lesser; b where one is not a number.
inline Lane min_lane(Lane a, Lane b) { return a < b ? a : b; }
inline Lane abs_lane(Lane v) {
  const LaneMask magnitude = {0x7fffffff, 0x7fffffff, 0x7fffffff, 0x7fffffff};
  return reinterpret_cast<Lane>(reinterpret_cast<LaneMask>(v) & magnitude);
}
inline Lane sqrt_lane(Lane v) {
#if defined(__SSE__)
  return _mm_sqrt_ps(v);
#elif defined(__aarch64__)
  return vsqrtq_f32(v);
#else
  return Lane{std::sqrt(v[0]), std::sqrt(v[1]), std::sqrt(v[2]), std::sqrt(v[3])};
#endif
}

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

/// `sum_lane` of each.
inline Lane sum_lanes(Lane a, Lane b, Lane c, Lane d) {
  transpose(&a, &b, &c, &d);
  return (a + b) + (c + d);
}

/// Bilinear interpolation of four 2x2 pixels: the upper left ones by their offset in an image of
/// `width`, and the positions within.
inline Lane blend_lanes(const float* image, std::ptrdiff_t width, LaneMask offset, Lane fx,
                        Lane fy) {
  // Two neighbours in a row are loaded as one double.
  using Pairs = double __attribute__((vector_size(16)));
  const auto pair = [image](std::ptrdiff_t at) {
    double two;
    __builtin_memcpy(&two, image + at, sizeof(two));
    return two;
  };
  const auto u0 = reinterpret_cast<Lane>(Pairs{pair(offset[0]), pair(offset[1])});
  const auto u1 = reinterpret_cast<Lane>(Pairs{pair(offset[2]), pair(offset[3])});
  const auto l0 = reinterpret_cast<Lane>(Pairs{pair(offset[0] + width), pair(offset[1] + width)});
  const auto l1 = reinterpret_cast<Lane>(Pairs{pair(offset[2] + width), pair(offset[3] + width)});
  const Lane upper_left = __builtin_shufflevector(u0, u1, 0, 2, 4, 6);
  const Lane upper_right = __builtin_shufflevector(u0, u1, 1, 3, 5, 7);
  const Lane lower_left = __builtin_shufflevector(l0, l1, 0, 2, 4, 6);
  const Lane lower_right = __builtin_shufflevector(l0, l1, 1, 3, 5, 7);
  const Lane top = upper_left + fx * (upper_right - upper_left);
  const Lane bottom = lower_left + fx * (lower_right - lower_left);
  return top + fy * (bottom - top);
}

/// `sample` of interpolation.h at four positions at once, bit for bit the same. All four must
/// satisfy its precondition.
inline Lane sample_lanes(const ImageF& image, Lane x, Lane y) {
  const LaneMask ix = __builtin_convertvector(x, LaneMask);
  const LaneMask iy = __builtin_convertvector(y, LaneMask);
  const LaneMask offset = iy * image.width() + ix;
  return blend_lanes(image.data(), image.width(), offset, x - __builtin_convertvector(ix, Lane),
                     y - __builtin_convertvector(iy, Lane));
}

/// Values and gradients of an image at four positions [grey levels, grey levels / px].
struct LaneSample {
  Lane value, gx, gy;
};

/// `sample_with_gradient` at four positions at once, bit for bit the same: pixels by their offset
/// in the image, and the positions within them. All four must satisfy its precondition.
inline LaneSample sample_lanes_with_gradient(const ImageF& image, const std::int32_t* offset,
                                             Lane fx, Lane fy) {
  Lane blended[kLanes];
  Lane vertical[kLanes];
  const std::ptrdiff_t w = image.width();
  const float* corner = image.data() - 1 - w;
  for (std::size_t i = 0; i < kLanes; ++i) {
    const Lane f = lane_of(fy[i]);
    const float* row = corner + offset[i];
    const Lane r0 = load_lane(row);
    const Lane r1 = load_lane(row + w);
    const Lane r2 = load_lane(row + 2 * w);
    const Lane r3 = load_lane(row + 3 * w);
    blended[i] = r1 + f * (r2 - r1);
    const Lane upper = r2 - r0;
    const Lane lower = r3 - r1;
    vertical[i] = upper + f * (lower - upper);
  }
  transpose(&blended[0], &blended[1], &blended[2], &blended[3]);
  transpose(&vertical[0], &vertical[1], &vertical[2], &vertical[3]);
  const Lane half = lane_of(0.5F);
  const Lane left = blended[2] - blended[0];
  const Lane right = blended[3] - blended[1];
  return {blended[1] + fx * (blended[2] - blended[1]), half * (left + fx * (right - left)),
          half * (vertical[1] + fx * (vertical[2] - vertical[1]))};
}

/// The same from positions.
inline LaneSample sample_lanes_with_gradient(const ImageF& image, Lane x, Lane y) {
  const LaneMask ix = __builtin_convertvector(x, LaneMask);
  const LaneMask iy = __builtin_convertvector(y, LaneMask);
  std::int32_t offset[kLanes];
  for (std::size_t i = 0; i < kLanes; ++i) offset[i] = iy[i] * image.width() + ix[i];
  return sample_lanes_with_gradient(image, offset, x - __builtin_convertvector(ix, Lane),
                                    y - __builtin_convertvector(iy, Lane));
}

}  // namespace sovo
