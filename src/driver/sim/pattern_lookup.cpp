#include "sovo/driver/sim/pattern_lookup.h"

#include <algorithm>

#include "sovo/driver/sim/kernel.h"

namespace sovo::sim {
namespace {

/// Places relative to the foot are held in steps of 2^-20 of a pattern's side; those further away
/// than this are seen so small that only the mean is left.
constexpr float kFractionSteps = 1048576.0F;
constexpr float kFarthest = 2047.0F;

/// Where and how finely the pattern is looked up.
struct Lookups {
  alignas(32) std::array<std::uint32_t, kBatch> u, v;            ///< Of the first probe.
  alignas(32) std::array<std::uint32_t, kBatch> step_u, step_v;  ///< To the next one.
  alignas(32) std::array<int, kBatch> log_side;                  ///< Of the finer level.
  alignas(32) std::array<int, kBatch> probes;
  alignas(32) BatchFloats share;   ///< Of one probe.
  alignas(32) BatchFloats blend;   ///< With the coarser level.
  alignas(32) BatchFloats detail;  ///< What is left of it before the mean.
  int most_probes = 1;
  bool blended = true;  ///< Some take more than one texel's neighbourhood.
};

/// The pattern's map in single precision, its shift folded into the place of the foot.
struct FlatMap {
  float xu, yu, xv, yv;
  TexturePlace foot;
  float log_texels;
  int log_size;
};

inline std::uint32_t to_place(float sides) {
  const float within = std::min(kFarthest, std::max(-kFarthest, sides));
  return static_cast<std::uint32_t>(static_cast<std::int32_t>(within * kFractionSteps)) << 12;
}

SOVO_SIM_KERNEL void place(const FlatMap& map, const SpotPlaces& places, const Spots& spots,
                           Lookups* __restrict lookups) {
  const FlatMap m = map;
  const float* const __restrict x = places.x->data();
  const float* const __restrict y = places.y->data();
  const float* const __restrict long_x = places.long_x->data();
  const float* const __restrict long_y = places.long_y->data();
  const auto top = static_cast<float>(m.log_size);
  const int coarsest = m.log_size - 2;
  const auto end = static_cast<std::size_t>(spots.end);
  int most = 1;
  int highest = 0;
  for (std::size_t i = 0; i < end; ++i) {
    const bool magnified = spots.log_long[i] + m.log_texels <= 0.0F;
    const int probes = magnified ? 1 : spots.probes[i];
    const float share = magnified ? 1.0F : spots.share[i];
    const float wanted = spots.log_probe[i] + m.log_texels + kLevelBias;
    const float within = std::min(top, std::max(0.0F, wanted));
    const float level = magnified ? 0.0F : within;
    const int whole = static_cast<int>(level);
    const int lower = whole < coarsest ? whole : coarsest;
    lookups->log_side[i] = m.log_size - lower;
    lookups->blend[i] = std::min(1.0F, level - static_cast<float>(lower));
    lookups->detail[i] = std::min(1.0F, top - level);
    lookups->probes[i] = probes;
    lookups->share[i] = share;
    const float half = 0.5F * share;
    const std::uint32_t half_u = to_place(half * (m.xu * long_x[i] + m.yu * long_y[i]));
    const std::uint32_t half_v = to_place(half * (m.xv * long_x[i] + m.yv * long_y[i]));
    const auto back = static_cast<std::uint32_t>(probes - 1);
    lookups->u[i] = m.foot.u + to_place(m.xu * x[i] + m.yu * y[i]) - half_u * back;
    lookups->v[i] = m.foot.v + to_place(m.xv * x[i] + m.yv * y[i]) - half_v * back;
    lookups->step_u[i] = half_u * 2U;
    lookups->step_v[i] = half_v * 2U;
    most = most > probes ? most : probes;
    highest |= level > 0.0F ? 1 : 0;
  }
  lookups->most_probes = most;
  lookups->blended = highest != 0 || most > 1;
}

SOVO_SIM_KERNEL void add_probe(const std::uint32_t* __restrict quads, int probe, int end,
                               Lookups* __restrict lookups, float* __restrict sum) {
  Lookups& l = *lookups;
  for (std::size_t i = 0; i < static_cast<std::size_t>(end); ++i) {
    const TexturePlace place{l.u[i], l.v[i]};
    const float fine = Texture::texel(quads, l.log_side[i], place);
    const float coarse = Texture::texel(quads, l.log_side[i] - 1, place);
    const float value = l.share[i] * (fine + l.blend[i] * (coarse - fine));
    sum[i] += probe < l.probes[i] ? value : 0.0F;
    l.u[i] += l.step_u[i];
    l.v[i] += l.step_v[i];
  }
}

/// The only probe of spots that are all finer than the pattern.
SOVO_SIM_KERNEL void look_closely(const std::uint32_t* __restrict quads, int log_size, int end,
                                  const Lookups& lookups, float* __restrict sum) {
  for (std::size_t i = 0; i < static_cast<std::size_t>(end); ++i) {
    sum[i] = Texture::texel(quads, log_size, {lookups.u[i], lookups.v[i]});
  }
}

}  // namespace

void look_up(const Texture& texture, const PatternMap& map, const SpotPlaces& places,
             const Spots& spots, BatchFloats* result) {
  const double u = map.map[0] * places.foot_x + map.map[1] * places.foot_y + map.shift[0];
  const double v = map.map[2] * places.foot_x + map.map[3] * places.foot_y + map.shift[1];
  const FlatMap flat{static_cast<float>(map.map[0]),
                     static_cast<float>(map.map[1]),
                     static_cast<float>(map.map[2]),
                     static_cast<float>(map.map[3]),
                     {texture_fraction(u), texture_fraction(v)},
                     map.log_texels,
                     texture.log_size()};
  Lookups lookups;
  place(flat, places, spots, &lookups);
  if (lookups.blended) {
    std::fill(result->begin(), result->begin() + spots.end, 0.0F);
    for (int k = 0; k < lookups.most_probes; ++k) {
      add_probe(texture.quads(), k, spots.end, &lookups, result->data());
    }
  } else {
    look_closely(texture.quads(), texture.log_size(), spots.end, lookups, result->data());
  }
  const float mean = texture.mean();
  for (std::size_t i = 0; i < static_cast<std::size_t>(spots.end); ++i) {
    (*result)[i] = mean + lookups.detail[i] * (Texture::kScale * (*result)[i] - mean);
  }
}

}  // namespace sovo::sim
