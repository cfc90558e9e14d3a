#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "sovo/image/lanes.h"
#include "sovo/vo/pattern.h"

namespace sovo {

/// The pattern's offsets.
struct PatternOffsetArrays {
  alignas(32) std::array<float, kPatternSize> x{}, y{};
  constexpr PatternOffsetArrays() {
    for (std::size_t k = 0; k < kPatternSize; ++k) {
      x[k] = kPattern[k].x;
      y[k] = kPattern[k].y;
    }
  }
};
inline constexpr PatternOffsetArrays kPatternOffsets;

/// How the pattern's pixels move into the target image: K R K^-1 of its centre with K t rho, and of
/// a step along x and along y.
struct PatternWarp {
  float centre[3], along_x[3], along_y[3];
  int width, height;
};

/// Pixels and positions within them; whether all lie in the image with room for gradients.
struct PlacePattern {
  template <class F>
  SOVO_LANE_FUNCTION static bool run(const PatternWarp& w, float* fx, float* fy,
                                     std::int32_t* offset) {
    bool inside = true;
    for (std::size_t k = 0; k < kPatternSize; k += lanes_of<F>) {
      const F dx = load_lane<F>(&kPatternOffsets.x[k]);
      const F dy = load_lane<F>(&kPatternOffsets.y[k]);
      const F pz = w.centre[2] + w.along_x[2] * dx + w.along_y[2] * dy;
      const F px = w.centre[0] + w.along_x[0] * dx + w.along_y[0] * dy;
      const F py = w.centre[1] + w.along_x[1] * dx + w.along_y[1] * dy;
      const F iz = 1.0F / pz;
      const F u = px * iz;
      const F v = py * iz;
      // Written so that NaN counts as outside.
      inside = inside && all_of(MaskOf<F>((pz > 0.0F) & (u > 1.1F) & (v > 1.1F) &
                                          (u < static_cast<float>(w.width - 3)) &
                                          (v < static_cast<float>(w.height - 3))));
      const MaskOf<F> iu = to_int(u);
      const MaskOf<F> iv = to_int(v);
      store_lane(F(u - to_float<F>(iu)), fx + k);
      store_lane(F(v - to_float<F>(iv)), fy + k);
      store_mask(MaskOf<F>(iv * w.width + iu), offset + k);
    }
    return inside;
  }
};

/// What the residuals of a pattern are made of.
struct PatternInput {
  const ImageF* image;
  const std::int32_t* offset;  ///< The projected pattern.
  const float *fx, *fy;
  const float *colour, *weight;  ///< Of the point.
  float gain, bias;              ///< Host to target.
  float frozen_gain, frozen_host_b;
  float huber, squared_gradient_constant;
};

/// Weighted residuals and Gram matrix of (gx, gy, ja, jb), as many pixels at a time as F has lanes.
struct SumPattern {
  template <class F>
  SOVO_LANE_FUNCTION static void run(const PatternInput& in, float* totals) {
    const F c2 = lane_of<F>(in.squared_gradient_constant);
    const F one = lane_of<F>(1.0F);
    F sums[16];
    for (std::size_t k = 0; k < kPatternSize; k += lanes_of<F>) {
      const auto s = sample_lanes_with_gradient(*in.image, in.offset + k, load_lane<F>(in.fx + k),
                                                load_lane<F>(in.fy + k));
      const F colour = load_lane<F>(in.colour + k);
      const F residual = s.value - (in.gain * colour + in.bias);
      const F gradient_squared = s.gx * s.gx + s.gy * s.gy;
      const F w = 0.5F * (sqrt_lane(F(c2 / (c2 + gradient_squared))) + load_lane<F>(in.weight + k));
      const F hw = min_lane(one, F(in.huber / abs_lane(residual)));
      const F weight = sqrt_lane(hw) * w;
      const F wr = weight * residual;
      // d r / d (log-gain), d r / d bias of the target; the gain is the frozen one.
      const F gx = weight * s.gx;
      const F gy = weight * s.gy;
      const F ja = -weight * in.frozen_gain * (colour - in.frozen_host_b);
      const F jb = -weight;
      const F terms[16] = {
          gx * gx, gx * gy, gx * ja, gx * jb, gy * gy, gy * ja, gy * jb, ja * ja,
          ja * jb, jb * jb, gx * wr, gy * wr, ja * wr, jb * wr, wr * wr, wr * wr * (2.0F - hw)};
      for (std::size_t i = 0; i < 16; ++i) sums[i] = k == 0 ? terms[i] : sums[i] + terms[i];
    }
    store_sums(sums, totals);
    store_sums(sums + 8, totals + 8);
  }
};

}  // namespace sovo
