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

/// Where pixels of a pattern lie, from pixel k on.
template <class F>
struct WarpedLanes {
  F u, v;
  F iz;  ///< 1 / z, of a z in which the centre's is `centre[2]`.
  MaskOf<F> in_front;
};
template <class F>
SOVO_LANE_FUNCTION WarpedLanes<F> warp_lanes(const PatternWarp& w, std::size_t k) {
  const F dx = load_lane<F>(&kPatternOffsets.x[k]);
  const F dy = load_lane<F>(&kPatternOffsets.y[k]);
  const F pz = w.centre[2] + w.along_x[2] * dx + w.along_y[2] * dy;
  const F px = w.centre[0] + w.along_x[0] * dx + w.along_y[0] * dy;
  const F py = w.centre[1] + w.along_x[1] * dx + w.along_y[1] * dy;
  const F iz = 1.0F / pz;
  return {px * iz, py * iz, iz, pz > 0.0F};
}

/// Pixels and positions within them; whether all lie in the image with room for gradients.
template <class F>
SOVO_LANE_FUNCTION bool place_lanes(const PatternWarp& w, const F& u, const F& v, F* fx, F* fy,
                                    std::int32_t* offset) {
  const MaskOf<F> iu = to_int(u);
  const MaskOf<F> iv = to_int(v);
  *fx = u - to_float<F>(iu);
  *fy = v - to_float<F>(iv);
  store_mask(MaskOf<F>(iv * w.width + iu), offset);
  // Written so that NaN counts as outside.
  return all_of(MaskOf<F>((u > 1.1F) & (v > 1.1F) & (u < static_cast<float>(w.width - 3)) &
                          (v < static_cast<float>(w.height - 3))));
}

/// The same of the whole pattern, which must lie in front as well.
struct PlacePattern {
  template <class F>
  SOVO_LANE_FUNCTION static bool run(const PatternWarp& w, float* fx, float* fy,
                                     std::int32_t* offset) {
    bool inside = true;
    for (std::size_t k = 0; k < kPatternSize; k += lanes_of<F>) {
      const WarpedLanes<F> at = warp_lanes<F>(w, k);
      F x, y;
      const bool placed = place_lanes(w, at.u, at.v, &x, &y, offset + k);
      inside = inside && placed && all_of(at.in_front);
      store_lane(x, fx + k);
      store_lane(y, fy + k);
    }
    return inside;
  }
};

/// How much more a target's image blurs a pattern than its host's does, in variances along the axes
/// of the host [px^2]: by the cameras' point spread, which is that of a smaller pattern in a
/// smaller image of it, and by the interpolation in the target, f (1 - f) between two pixels.
struct PatternSpread {
  float uu = 1.0F, uv = 0.0F, vu = 0.0F, vv = 1.0F;  ///< (d (host pixel) / d (target pixel))^2.
};

/// What the residuals of a pattern are made of.
struct PatternInput {
  const ImageF* image;
  const std::int32_t* offset;  ///< The projected pattern.
  const float *fx, *fy;
  const float *colour, *weight;      ///< Of the point,
  const float *narrow_u, *narrow_v;  ///< and what blur adds to its colours.
  const float *wide_u, *wide_v;
  float gain, bias;  ///< Host to target.
  float frozen_gain, frozen_host_b;
  float huber, squared_gradient_constant;
  PatternSpread spread;
  float point_spread;  ///< Variance of a camera's point spread [px^2].
  float most_spread;   ///< What is taken of a difference; 0: colours as they are.
};

/// What blur of this variance adds along an axis: a mixture of kernels, whose variances mix alike.
template <class F>
SOVO_LANE_FUNCTION F blur_lanes(const F& variance, const float* narrow, const float* wide) {
  constexpr float kStep = kWideBlur - kNarrowBlur;
  const F one = lane_of<F>(1.0F);
  const F some = min_lane(one, F((1.0F / kNarrowBlur) * variance));
  const F more = clamp_lane(F((1.0F / kStep) * (variance - kNarrowBlur)), F{}, one);
  return some * load_lane<F>(narrow) + more * load_lane<F>(wide);
}

/// Colours of pixels k on as the target's image blurs them.
template <class F>
SOVO_LANE_FUNCTION F spread_colours(const PatternInput& in, std::size_t k) {
  const F fx = load_lane<F>(in.fx + k);
  const F fy = load_lane<F>(in.fy + k);
  const F u = fx * (1.0F - fx) + in.point_spread;
  const F v = fy * (1.0F - fy) + in.point_spread;
  const F none{};
  const F most = lane_of<F>(in.most_spread);
  const PatternSpread& s = in.spread;
  const F along_u = clamp_lane(F(s.uu * u + s.uv * v - in.point_spread), none, most);
  const F along_v = clamp_lane(F(s.vu * u + s.vv * v - in.point_spread), none, most);
  return load_lane<F>(in.colour + k) + blur_lanes<F>(along_u, in.narrow_u + k, in.wide_u + k) +
         blur_lanes<F>(along_v, in.narrow_v + k, in.wide_v + k);
}

/// Weighted residuals and Gram matrix of (gx, gy, ja, jb), as many pixels at a time as F has lanes.
struct PatternSums {
  /// Those of pixels k on, of these colours, where the image has these grey levels and gradients.
  template <class F, class Samples>
  SOVO_LANE_FUNCTION static void add(const PatternInput& in, std::size_t k, const F& colour,
                                     const Samples& s, F* sums) {
    const F c2 = lane_of<F>(in.squared_gradient_constant);
    const F one = lane_of<F>(1.0F);
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
};

/// The sums of a pattern as its image shows it.
struct SumPattern {
  template <class F>
  SOVO_LANE_FUNCTION static void run(const PatternInput& in, float* totals) {
    F sums[16];
    for (std::size_t k = 0; k < kPatternSize; k += lanes_of<F>) {
      const auto s = sample_lanes_with_gradient(*in.image, in.offset + k, load_lane<F>(in.fx + k),
                                                load_lane<F>(in.fy + k));
      PatternSums::add(in, k, spread_colours<F>(in, k), s, sums);
    }
    store_sums(sums, totals);
    store_sums(sums + 8, totals + 8);
  }
};

/// A line that a blurred pattern is smeared along, in the image: its length and direction [px], and
/// at how many places the image is taken, evenly spaced and symmetric around the middle.
struct Smear {
  float u, v;
  int places;
};

/// Grey levels of the pattern around (u, v), each the mean along a line; false where that leaves
/// the image.
struct SmearColours {
  template <class F>
  SOVO_LANE_FUNCTION static bool run(const ImageF& image, float u, float v, const Smear& smear,
                                     float* colours) {
    constexpr std::size_t n = lanes_of<F>;
    const int w = image.width();
    std::int32_t offset[kPatternSize];
    for (std::size_t k = 0; k < kPatternSize; ++k) {
      offset[k] = static_cast<int>(kPattern[k].y) * w + static_cast<int>(kPattern[k].x);
    }
    F sums[kPatternSize / n] = {};
    const float share = 1.0F / static_cast<float>(smear.places);
    for (int i = 0; i < smear.places; ++i) {
      const float along = (static_cast<float>(i) + 0.5F) * share - 0.5F;
      const float x = u + along * smear.u;
      const float y = v + along * smear.v;
      // Written so that NaN counts as outside.
      const bool inside = x >= 2.0F && y >= 2.0F && x < static_cast<float>(w - 3) &&
                          y < static_cast<float>(image.height() - 3);
      if (!inside) return false;
      const int ix = static_cast<int>(x);
      const int iy = static_cast<int>(y);
      const float* middle = image.data() + static_cast<std::ptrdiff_t>(iy) * w + ix;
      const F fx = lane_of<F>(x - static_cast<float>(ix));
      const F fy = lane_of<F>(y - static_cast<float>(iy));
      for (std::size_t k = 0; k < kPatternSize; k += n) {
        sums[k / n] += share * blend_lanes(middle, w, offset + k, fx, fy);
      }
    }
    for (std::size_t k = 0; k < kPatternSize; k += n) store_lane(sums[k / n], colours + k);
    return true;
  }
};

/// A pattern's grey levels and gradients [grey levels, grey levels / px], each the mean along a
/// line.
struct SmearedPattern {
  alignas(32) std::array<float, kPatternSize> value{}, gx{}, gy{};
};

/// Takes them; false where a place lies beside the image.
struct SmearPattern {
  template <class F>
  SOVO_LANE_FUNCTION static bool run(const ImageF& image, const PatternWarp& warp,
                                     const Smear& smear, SmearedPattern* out) {
    std::int32_t offset[lanes_of<F>];
    const float share = 1.0F / static_cast<float>(smear.places);
    for (std::size_t k = 0; k < kPatternSize; k += lanes_of<F>) {
      const WarpedLanes<F> at = warp_lanes<F>(warp, k);
      bool inside = all_of(at.in_front);
      const F line_u = smear.u * warp.centre[2] * at.iz;
      const F line_v = smear.v * warp.centre[2] * at.iz;
      F value{}, gx{}, gy{};
      for (int i = 0; i < smear.places; ++i) {
        const float along = (static_cast<float>(i) + 0.5F) * share - 0.5F;
        F fx, fy;
        inside = place_lanes(warp, F(at.u + along * line_u), F(at.v + along * line_v), &fx, &fy,
                             offset) &&
                 inside;
        if (!inside) return false;
        const auto s = sample_lanes_with_gradient(image, offset, fx, fy);
        value += share * s.value;
        gx += share * s.gx;
        gy += share * s.gy;
      }
      store_lane(value, &out->value[k]);
      store_lane(gx, &out->gx[k]);
      store_lane(gy, &out->gy[k]);
    }
    return true;
  }
};

/// The sums of a pattern that was smeared; `image`, `offset`, `fx`, `fy` and the spread are not
/// looked at.
struct SumSmearedPattern {
  template <class F>
  struct Samples {
    F value, gx, gy;
  };
  template <class F>
  SOVO_LANE_FUNCTION static void run(const PatternInput& in, const SmearedPattern& smeared,
                                     float* totals) {
    F sums[16];
    for (std::size_t k = 0; k < kPatternSize; k += lanes_of<F>) {
      const Samples<F> s = {load_lane<F>(&smeared.value[k]), load_lane<F>(&smeared.gx[k]),
                            load_lane<F>(&smeared.gy[k])};
      PatternSums::add(in, k, load_lane<F>(in.colour + k), s, sums);
    }
    store_sums(sums, totals);
    store_sums(sums + 8, totals + 8);
  }
};

}  // namespace sovo
