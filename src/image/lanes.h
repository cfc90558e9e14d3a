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

// Wide registers are passed in another way where the processor has them: nothing here is called.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"
#endif

namespace sovo {

/// Lanes: floats that the compiler keeps in one register, four (SSE, NEON) or eight (AVX2, and
/// AVX-512, which has twice the registers, masks, and eight doubles in one): GCC's
/// vector extension, so that one source serves every machine and each lane computes exactly what
/// scalar code would. Sums over eight lanes are those over four of their halves, so that every
/// machine gives the same bits.
using Lane = float __attribute__((vector_size(16)));
using WideLane = float __attribute__((vector_size(32)));
inline constexpr std::size_t kLanes = 4;
inline constexpr std::size_t kWideLanes = 8;

/// Whole numbers; as the result of a comparison -1 where it holds, else 0.
using LaneMask = std::int32_t __attribute__((vector_size(16)));
using WideLaneMask = std::int32_t __attribute__((vector_size(32)));

/// Of a function of lanes. Registers of eight lanes are passed differently by functions that are
/// compiled for them and functions that are not: none of these may be called.
#define SOVO_LANE_FUNCTION [[gnu::always_inline]] inline

/// Compiled for processors that have registers of eight lanes, and for those with AVX-512.
#if defined(__x86_64__)
#define SOVO_WIDE_FUNCTION [[gnu::target("avx2")]]
#define SOVO_AVX512_FUNCTION [[gnu::target("avx512f,avx512bw,avx512dq,avx512vl")]]
inline constexpr bool kMayHaveWideLanes = true;
#else
#define SOVO_WIDE_FUNCTION
#define SOVO_AVX512_FUNCTION
inline constexpr bool kMayHaveWideLanes = false;
#endif

/// Whether this processor has registers of eight lanes.
inline bool has_wide_lanes() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("avx2") != 0;
#else
  return false;
#endif
}

/// Whether it has AVX-512, as server processors of Intel since 2017 and AMD's since Zen 4.
inline bool has_avx512() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("avx512vl") != 0 && __builtin_cpu_supports("avx512dq") != 0 &&
         __builtin_cpu_supports("avx512bw") != 0;
#else
  return false;
#endif
}

/// Which lanes `run_kernel` takes here.
inline const char* lanes_name() {
#if defined(__x86_64__)
  return has_avx512() ? "avx512" : (has_wide_lanes() ? "avx2" : "sse");
#elif defined(__aarch64__)
  return "neon";
#else
  return "scalar";
#endif
}

/// A kernel is a type with a lane function template `run`: this is `run` in four lanes.
template <class Kernel, class... Args>
auto run_narrow(const Args&... args) {
  return Kernel::template run<Lane>(args...);
}

/// And in eight; only where `has_wide_lanes`.
template <class Kernel, class... Args>
SOVO_WIDE_FUNCTION auto run_wide(const Args&... args) {
  return Kernel::template run<WideLane>(args...);
}

/// And with AVX-512; only where `has_avx512`.
template <class Kernel, class... Args>
SOVO_AVX512_FUNCTION auto run_avx512(const Args&... args) {
  return Kernel::template run<WideLane>(args...);
}

/// With the best that this processor has.
template <class Kernel, class... Args>
auto run_kernel(const Args&... args) {
  if constexpr (kMayHaveWideLanes) {
    if (has_avx512()) return run_avx512<Kernel>(args...);
    if (has_wide_lanes()) return run_wide<Kernel>(args...);
  }
  return run_narrow<Kernel>(args...);
}

namespace lane_detail {
template <class F>
struct Traits;
template <>
struct Traits<Lane> {
  using Mask = LaneMask;
  using Doubles = double __attribute__((vector_size(32)));
};
template <>
struct Traits<WideLane> {
  using Mask = WideLaneMask;
  using Doubles = double __attribute__((vector_size(64)));
};
}  // namespace lane_detail

/// How many floats F holds, and its mask.
template <class F>
inline constexpr std::size_t lanes_of = sizeof(F) / sizeof(float);
template <class F>
using MaskOf = typename lane_detail::Traits<F>::Mask;

/// As many doubles.
template <class F>
using DoublesOf = typename lane_detail::Traits<F>::Doubles;

template <class F = Lane>
SOVO_LANE_FUNCTION F load_lane(const float* p) {
  F v;
  __builtin_memcpy(&v, p, sizeof(v));
  return v;
}
template <class F>
SOVO_LANE_FUNCTION void store_lane(const F& v, float* p) {
  __builtin_memcpy(p, &v, sizeof(v));
}
template <class M>
SOVO_LANE_FUNCTION M load_mask(const std::int32_t* p) {
  M v;
  __builtin_memcpy(&v, p, sizeof(v));
  return v;
}
template <class M>
SOVO_LANE_FUNCTION void store_mask(const M& v, std::int32_t* p) {
  __builtin_memcpy(p, &v, sizeof(v));
}
template <class F = Lane>
SOVO_LANE_FUNCTION F lane_of(float x) {
  return x - F{};
}

/// 0, 1, 2, ...
template <class F = Lane>
SOVO_LANE_FUNCTION F lane_index() {
  F v;
  for (std::size_t i = 0; i < lanes_of<F>; ++i) v[i] = static_cast<float>(i);
  return v;
}
template <class F>
SOVO_LANE_FUNCTION MaskOf<F> to_int(const F& v) {
  return __builtin_convertvector(v, MaskOf<F>);
}
template <class F>
SOVO_LANE_FUNCTION F to_float(const MaskOf<F>& v) {
  return __builtin_convertvector(v, F);
}

/// The first and the last four of eight.
SOVO_LANE_FUNCTION Lane low_half(const WideLane& v) {
  return __builtin_shufflevector(v, v, 0, 1, 2, 3);
}
SOVO_LANE_FUNCTION Lane high_half(const WideLane& v) {
  return __builtin_shufflevector(v, v, 4, 5, 6, 7);
}
SOVO_LANE_FUNCTION WideLane join(const Lane& low, const Lane& high) {
  return __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
}

/// Whether a comparison holds in all lanes.
SOVO_LANE_FUNCTION bool all_of(const LaneMask& mask) {
  return (mask[0] & mask[1] & mask[2] & mask[3]) != 0;
}
SOVO_LANE_FUNCTION bool all_of(const WideLaneMask& mask) {
  const LaneMask low = __builtin_shufflevector(mask, mask, 0, 1, 2, 3);
  const LaneMask high = __builtin_shufflevector(mask, mask, 4, 5, 6, 7);
  return all_of(low & high);
}

/// Whether it holds in none.
SOVO_LANE_FUNCTION bool none_of(const LaneMask& mask) {
  return (mask[0] | mask[1] | mask[2] | mask[3]) == 0;
}
SOVO_LANE_FUNCTION bool none_of(const WideLaneMask& mask) {
  const LaneMask low = __builtin_shufflevector(mask, mask, 0, 1, 2, 3);
  const LaneMask high = __builtin_shufflevector(mask, mask, 4, 5, 6, 7);
  return none_of(low | high);
}

/// The lesser; b where one is not a number.
template <class F>
SOVO_LANE_FUNCTION F min_lane(const F& a, const F& b) {
  return a < b ? a : b;
}
/// v, `least` or `most`; `most` where v is not a number.
template <class F>
SOVO_LANE_FUNCTION F clamp_lane(const F& v, const F& least, const F& most) {
  const F below = min_lane(v, most);
  return below < least ? least : below;
}
template <class F>
SOVO_LANE_FUNCTION F abs_lane(const F& v) {
  using M = MaskOf<F>;
  return reinterpret_cast<F>(reinterpret_cast<M>(v) & (M{} + 0x7fffffff));
}
SOVO_LANE_FUNCTION Lane sqrt_lane(const Lane& v) {
#if defined(__SSE__)
  return _mm_sqrt_ps(v);
#elif defined(__aarch64__)
  return vsqrtq_f32(v);
#else
  return Lane{std::sqrt(v[0]), std::sqrt(v[1]), std::sqrt(v[2]), std::sqrt(v[3])};
#endif
}
SOVO_LANE_FUNCTION WideLane sqrt_lane(const WideLane& v) {
  return join(sqrt_lane(low_half(v)), sqrt_lane(high_half(v)));
}

/// Sum in a fixed order.
SOVO_LANE_FUNCTION float sum_lane(const Lane& v) { return (v[0] + v[1]) + (v[2] + v[3]); }

/// Rows become columns; of eight lanes in each half.
SOVO_LANE_FUNCTION void transpose(Lane* a, Lane* b, Lane* c, Lane* d) {
  const Lane ab_low = __builtin_shufflevector(*a, *b, 0, 4, 1, 5);
  const Lane ab_high = __builtin_shufflevector(*a, *b, 2, 6, 3, 7);
  const Lane cd_low = __builtin_shufflevector(*c, *d, 0, 4, 1, 5);
  const Lane cd_high = __builtin_shufflevector(*c, *d, 2, 6, 3, 7);
  *a = __builtin_shufflevector(ab_low, cd_low, 0, 1, 4, 5);
  *b = __builtin_shufflevector(ab_low, cd_low, 2, 3, 6, 7);
  *c = __builtin_shufflevector(ab_high, cd_high, 0, 1, 4, 5);
  *d = __builtin_shufflevector(ab_high, cd_high, 2, 3, 6, 7);
}
SOVO_LANE_FUNCTION void transpose(WideLane* a, WideLane* b, WideLane* c, WideLane* d) {
  const WideLane ab_low = __builtin_shufflevector(*a, *b, 0, 8, 1, 9, 4, 12, 5, 13);
  const WideLane ab_high = __builtin_shufflevector(*a, *b, 2, 10, 3, 11, 6, 14, 7, 15);
  const WideLane cd_low = __builtin_shufflevector(*c, *d, 0, 8, 1, 9, 4, 12, 5, 13);
  const WideLane cd_high = __builtin_shufflevector(*c, *d, 2, 10, 3, 11, 6, 14, 7, 15);
  *a = __builtin_shufflevector(ab_low, cd_low, 0, 1, 8, 9, 4, 5, 12, 13);
  *b = __builtin_shufflevector(ab_low, cd_low, 2, 3, 10, 11, 6, 7, 14, 15);
  *c = __builtin_shufflevector(ab_high, cd_high, 0, 1, 8, 9, 4, 5, 12, 13);
  *d = __builtin_shufflevector(ab_high, cd_high, 2, 3, 10, 11, 6, 7, 14, 15);
}

/// `sum_lane` of each.
SOVO_LANE_FUNCTION Lane sum_lanes(Lane a, Lane b, Lane c, Lane d) {
  transpose(&a, &b, &c, &d);
  return (a + b) + (c + d);
}

/// Sums of the halves of one, and of another.
SOVO_LANE_FUNCTION WideLane fold(const WideLane& a, const WideLane& b) {
  return __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11) +
         __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15);
}

/// Sums of eight values at eight places each, `v[i]` the i-th value: of four of their halves.
SOVO_LANE_FUNCTION void store_sums(const WideLane* v, float* sums) {
  WideLane a = fold(v[0], v[4]);
  WideLane b = fold(v[1], v[5]);
  WideLane c = fold(v[2], v[6]);
  WideLane d = fold(v[3], v[7]);
  transpose(&a, &b, &c, &d);
  store_lane(WideLane((a + b) + (c + d)), sums);
}
SOVO_LANE_FUNCTION void store_sums(const Lane* v, float* sums) {
  store_lane(sum_lanes(v[0], v[1], v[2], v[3]), sums);
  store_lane(sum_lanes(v[4], v[5], v[6], v[7]), sums + kLanes);
}

/// Two neighbours in a row from each of four places, as they lie: (x0 x1) of the first two, then of
/// the last two.
struct LanePairs {
  Lane first, last;
};
SOVO_LANE_FUNCTION LanePairs load_pairs(const float* p, const std::int32_t* offset) {
  // They are loaded as one double.
  using Doubles = double __attribute__((vector_size(16)));
  double two[4];
  for (std::size_t i = 0; i < 4; ++i) __builtin_memcpy(&two[i], p + offset[i], sizeof(two[i]));
  return {reinterpret_cast<Lane>(Doubles{two[0], two[1]}),
          reinterpret_cast<Lane>(Doubles{two[2], two[3]})};
}

/// The left and the right neighbours of each place.
SOVO_LANE_FUNCTION void load_neighbours(const float* p, const std::int32_t* offset, Lane* left,
                                        Lane* right) {
  const LanePairs pairs = load_pairs(p, offset);
  *left = __builtin_shufflevector(pairs.first, pairs.last, 0, 2, 4, 6);
  *right = __builtin_shufflevector(pairs.first, pairs.last, 1, 3, 5, 7);
}
SOVO_LANE_FUNCTION void load_neighbours(const float* p, const std::int32_t* offset, WideLane* left,
                                        WideLane* right) {
  const LanePairs a = load_pairs(p, offset);
  const LanePairs b = load_pairs(p, offset + kLanes);
  const WideLane first = join(a.first, b.first);
  const WideLane last = join(a.last, b.last);
  *left = __builtin_shufflevector(first, last, 0, 2, 8, 10, 4, 6, 12, 14);
  *right = __builtin_shufflevector(first, last, 1, 3, 9, 11, 5, 7, 13, 15);
}

/// Bilinear interpolation of 2x2 pixels a lane: the upper left ones by their offset in an image of
/// `width`, and the positions within.
template <class F>
SOVO_LANE_FUNCTION F blend_lanes(const float* image, std::ptrdiff_t width,
                                 const std::int32_t* offset, const F& fx, const F& fy) {
  F upper_left, upper_right, lower_left, lower_right;
  load_neighbours(image, offset, &upper_left, &upper_right);
  load_neighbours(image + width, offset, &lower_left, &lower_right);
  const F top = upper_left + fx * (upper_right - upper_left);
  const F bottom = lower_left + fx * (lower_right - lower_left);
  return top + fy * (bottom - top);
}

/// `sample` of interpolation.h at a position a lane, bit for bit the same. All must satisfy its
/// precondition.
template <class F>
SOVO_LANE_FUNCTION F sample_lanes(const ImageF& image, const F& x, const F& y) {
  const MaskOf<F> ix = to_int(x);
  const MaskOf<F> iy = to_int(y);
  std::int32_t offset[lanes_of<F>];
  store_mask(iy * image.width() + ix, offset);
  return blend_lanes(image.data(), image.width(), offset, F(x - to_float<F>(ix)),
                     F(y - to_float<F>(iy)));
}

/// Values and gradients of an image at a position a lane [grey levels, grey levels / px].
template <class F>
struct BasicLaneSample {
  F value, gx, gy;
};
using LaneSample = BasicLaneSample<Lane>;

/// Four pixels in a row at each of four places, or of eight.
SOVO_LANE_FUNCTION Lane load_row(const float* p, const std::int32_t* offset, Lane /*of*/) {
  return load_lane(p + offset[0]);
}
SOVO_LANE_FUNCTION WideLane load_row(const float* p, const std::int32_t* offset, WideLane /*of*/) {
  return join(load_lane(p + offset[0]), load_lane(p + offset[kLanes]));
}

/// v[I] in all four lanes; of eight v[I] in the first and v[I + 4] in the last.
template <std::size_t I>
SOVO_LANE_FUNCTION Lane spread(const Lane& v) {
  return __builtin_shufflevector(v, v, I, I, I, I);
}
template <std::size_t I>
SOVO_LANE_FUNCTION WideLane spread(const WideLane& v) {
  return __builtin_shufflevector(v, v, I, I, I, I, I + 4, I + 4, I + 4, I + 4);
}

/// Four neighbours in a row around each position, between the rows: values, and differences of the
/// rows around.
template <class F>
struct BlendedRow {
  F value, vertical;
};
template <class F>
SOVO_LANE_FUNCTION BlendedRow<F> blend_rows(const float* corner, std::ptrdiff_t width,
                                            const std::int32_t* offset, const F& fy) {
  const F r0 = load_row(corner, offset, F{});
  const F r1 = load_row(corner + width, offset, F{});
  const F r2 = load_row(corner + 2 * width, offset, F{});
  const F r3 = load_row(corner + 3 * width, offset, F{});
  const F upper = r2 - r0;
  const F lower = r3 - r1;
  return {r1 + fy * (r2 - r1), upper + fy * (lower - upper)};
}

/// `sample_with_gradient` at a position a lane, bit for bit the same: pixels by their offset in the
/// image, and the positions within them. All must satisfy its precondition.
template <class F>
SOVO_LANE_FUNCTION BasicLaneSample<F> sample_lanes_with_gradient(const ImageF& image,
                                                                 const std::int32_t* offset,
                                                                 const F& fx, const F& fy) {
  const std::ptrdiff_t w = image.width();
  const float* corner = image.data() - 1 - w;
  auto p0 = blend_rows(corner, w, offset, spread<0>(fy));
  auto p1 = blend_rows(corner, w, offset + 1, spread<1>(fy));
  auto p2 = blend_rows(corner, w, offset + 2, spread<2>(fy));
  auto p3 = blend_rows(corner, w, offset + 3, spread<3>(fy));
  transpose(&p0.value, &p1.value, &p2.value, &p3.value);
  transpose(&p0.vertical, &p1.vertical, &p2.vertical, &p3.vertical);
  const F left = p2.value - p0.value;
  const F right = p3.value - p1.value;
  return {p1.value + fx * (p2.value - p1.value), 0.5F * (left + fx * (right - left)),
          0.5F * (p1.vertical + fx * (p2.vertical - p1.vertical))};
}

/// The same from positions.
template <class F>
SOVO_LANE_FUNCTION BasicLaneSample<F> sample_lanes_with_gradient(const ImageF& image, const F& x,
                                                                 const F& y) {
  const MaskOf<F> ix = to_int(x);
  const MaskOf<F> iy = to_int(y);
  std::int32_t offset[lanes_of<F>];
  store_mask(iy * image.width() + ix, offset);
  return sample_lanes_with_gradient(image, offset, F(x - to_float<F>(ix)), F(y - to_float<F>(iy)));
}

}  // namespace sovo

#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic pop
#endif
