#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "sovo/image/lanes.h"
#include "sovo/vo/tracking_reference.h"

namespace sovo {

/// Points are worked on by groups, whatever the lanes: sums are then the same.
inline constexpr std::size_t kTrackedGroup = kWideLanes;
/// Lanes of a group.
template <class F>
inline constexpr std::size_t kParts = kTrackedGroup / lanes_of<F>;

/// Motion and camera of a level, as the residuals want them.
struct Warp {
  Warp(const CameraModel& camera, const SE3& T)
      : fx(static_cast<float>(camera.fx)),
        fy(static_cast<float>(camera.fy)),
        cx(static_cast<float>(camera.cx)),
        cy(static_cast<float>(camera.cy)) {
    const Mat3 RKi = T.rotation_matrix() * camera.matrix().inverse();
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) m[i][j] = static_cast<float>(RKi(i, j));
      t[i] = static_cast<float>(T.translation()[i]);
    }
  }
  float m[3][3], t[3];  ///< R K^-1, and the translation.
  float fx, fy, cx, cy;
};

/// The points of a level, an image, and where it sees them.
struct TrackedPoints {
  const ReferenceLevel& level;
  const ImageF& image;
  Warp warp;
};

/// Reference points in the current frame.
template <class F>
struct Projected {
  F x, y, rho;                       ///< In the normalized image; inverse depth.
  F colour, weight;                  ///< In the reference.
  F fx, fy;                          ///< Position within its pixel.
  std::int32_t offset[lanes_of<F>];  ///< Of that pixel in the image.
  MaskOf<F> in_view;
};

/// As many values as there are, and zeros behind them.
template <class F>
SOVO_LANE_FUNCTION F load_some(const float* values, std::size_t count) {
  if (count >= lanes_of<F>) return load_lane<F>(values);
  alignas(32) float padded[lanes_of<F>] = {};
  for (std::size_t k = 0; k < count; ++k) padded[k] = values[k];
  return load_lane<F>(padded);
}

/// The points from i on; the last ones may not fill the lanes. Asks for their image lines.
template <class F>
SOVO_LANE_FUNCTION void project(const TrackedPoints& points, std::size_t i, Projected<F>* out) {
  const ImageF& image = points.image;
  const Warp& w = points.warp;
  const std::size_t size = points.level.size();
  const std::size_t left = i < size ? size - i : 0;
  const std::size_t at = std::min(i, size);
  const F u = load_some<F>(points.level.u.data() + at, left);
  const F v = load_some<F>(points.level.v.data() + at, left);
  const F rho = load_some<F>(points.level.rho.data() + at, left);
  out->colour = load_some<F>(points.level.colour.data() + at, left);
  out->weight = load_some<F>(points.level.weight.data() + at, left);
  const F px = w.m[0][0] * u + w.m[0][1] * v + w.m[0][2] + w.t[0] * rho;
  const F py = w.m[1][0] * u + w.m[1][1] * v + w.m[1][2] + w.t[1] * rho;
  const F pz = w.m[2][0] * u + w.m[2][1] * v + w.m[2][2] + w.t[2] * rho;
  const F iz = 1.0F / pz;
  out->x = px * iz;
  out->y = py * iz;
  out->rho = rho * iz;
  const F ku = w.fx * out->x + w.cx;
  const F kv = w.fy * out->y + w.cy;
  // Written so that NaN counts as outside.
  out->in_view =
      (pz > 0.0F) & (ku >= 2.0F) & (kv >= 2.0F) & (ku < static_cast<float>(image.width() - 3)) &
      (kv < static_cast<float>(image.height() - 3)) & (lane_index<F>() < static_cast<float>(left));
  // Outside, a pixel that can be read.
  const F one = lane_of<F>(1.0F);
  const F su = out->in_view ? ku : one;
  const F sv = out->in_view ? kv : one;
  const MaskOf<F> iu = to_int(su);
  const MaskOf<F> iv = to_int(sv);
  out->fx = su - to_float<F>(iu);
  out->fy = sv - to_float<F>(iv);
  store_mask(MaskOf<F>(iv * image.width() + iu), out->offset);
  for (std::size_t k = 0; k < lanes_of<F>; ++k) {
    const float* pixel = image.data() + out->offset[k];
    for (std::ptrdiff_t row = -1; row <= 2; ++row) {
      __builtin_prefetch(pixel + row * image.width());
    }
  }
}

/// What a residual is judged by.
struct ResidualConfig {
  float gain, bias;  ///< Reference to current.
  float huber, cutoff;
};

/// Where the points of a residual pass go, in groups; those without an inlier are left out.
/// Outliers have weight and values zero.
struct WarpedArrays {
  float *x, *y;  ///< In the normalized image.
  float *rho, *gx, *gy, *residual, *weight, *colour;

  /// Zeros from `at` on, one a lane.
  template <class F>
  SOVO_LANE_FUNCTION void clear(std::size_t at) const {
    for (float* v : {x, y, rho, gx, gy, residual, weight, colour}) store_lane(F{}, v + at);
  }
};

/// Their memory.
struct WarpedPoints {
  AlignedVector<float> x, y, rho, gx, gy, residual, weight, colour;
  std::size_t n = 0;
  void reserve(std::size_t size);
  WarpedArrays arrays() {
    return {x.data(),  y.data(),        rho.data(),    gx.data(),
            gy.data(), residual.data(), weight.data(), colour.data()};
  }
};

struct ResidualSums {
  double energy = 0.0;
  int in_view = 0, inliers = 0;
  std::size_t n = 0;  ///< Points written, whole groups.
};

/// Grey level from which a pixel only says that there is at least so much light.
inline constexpr float kWhite = 250.0F;

/// Residuals, Huber energies and image gradients of all points. A white pixel of which more light
/// is expected agrees, and says nothing about motion or brightness.
struct ResidualPass {
  template <class F>
  struct Sums {
    DoublesOf<F> energy[kParts<F>] = {};
    MaskOf<F> in_view{}, inliers{};
  };

  /// The residuals of some points. Whether any is an inlier.
  template <class F>
  SOVO_LANE_FUNCTION static bool add(const TrackedPoints& points, const ResidualConfig& config,
                                     const Projected<F>& p, std::size_t part, std::size_t at,
                                     const WarpedArrays& to, Sums<F>* sums) {
    const F zero = lane_of<F>(0.0F);
    const F saturated =
        lane_of<F>(2.0F * config.huber * config.cutoff - config.huber * config.huber);
    const auto s = sample_lanes_with_gradient(points.image, p.offset, p.fx, p.fy);
    const F r = s.value - (config.gain * p.colour + config.bias);
    const F magnitude = abs_lane(r);
    const MaskOf<F> white = p.in_view & (s.value >= kWhite) & (r <= 0.0F);
    const MaskOf<F> inlier = p.in_view & ~white & (magnitude <= config.cutoff);
    const F hw = min_lane(lane_of<F>(1.0F), F(config.huber / magnitude));
    const F energy = p.weight * (inlier ? F(hw * r * r * (2.0F - hw)) : saturated);
    sums->energy[part] +=
        __builtin_convertvector(F((p.in_view & ~white) ? energy : zero), DoublesOf<F>);
    sums->in_view -= p.in_view;
    sums->inliers -= inlier | white;
    store_lane(F(inlier ? p.x : zero), to.x + at);
    store_lane(F(inlier ? p.y : zero), to.y + at);
    store_lane(F(inlier ? p.rho : zero), to.rho + at);
    store_lane(F(inlier ? F(s.gx * points.warp.fx) : zero), to.gx + at);
    store_lane(F(inlier ? F(s.gy * points.warp.fy) : zero), to.gy + at);
    store_lane(F(inlier ? r : zero), to.residual + at);
    store_lane(F(inlier ? F(hw * p.weight) : zero), to.weight + at);
    store_lane(p.colour, to.colour + at);
    return !none_of(inlier);
  }

  template <class F>
  SOVO_LANE_FUNCTION static void run(const TrackedPoints& points, const ResidualConfig& config,
                                     const WarpedArrays& to, ResidualSums* out) {
    // Points that are projected, and their images asked for, before the first is sampled.
    constexpr std::size_t kAhead = 32;
    constexpr std::size_t n = lanes_of<F>;
    Sums<F> sums;
    Projected<F> projected[kAhead / n];
    const std::size_t size = points.level.size();
    for (std::size_t begin = 0; begin < size; begin += kAhead) {
      const std::size_t end = std::min(begin + kAhead, size);
      for (std::size_t i = begin; i < end; i += n) project(points, i, &projected[(i - begin) / n]);
      for (std::size_t group = begin; group < end; group += kTrackedGroup) {
        bool any = false;
        for (std::size_t part = 0; part < kParts<F>; ++part) {
          const std::size_t i = group + part * n;
          const std::size_t at = out->n + part * n;
          if (i < end) {
            const Projected<F>& p = projected[(i - begin) / n];
            any = add(points, config, p, part, at, to, &sums) || any;
          } else {
            to.clear<F>(at);
          }
        }
        if (any) out->n += kTrackedGroup;
      }
    }
    double energy[kTrackedGroup];
    __builtin_memcpy(energy, sums.energy, sizeof(energy));
    for (std::size_t k = 0; k < kTrackedGroup; k += 4) {
      out->energy += (energy[k] + energy[k + 1]) + (energy[k + 2] + energy[k + 3]);
    }
    for (std::size_t k = 0; k < n; ++k) {
      out->in_view += sums.in_view[k];
      out->inliers += sums.inliers[k];
    }
  }
};

/// Upper triangle of a 9x9 Gram matrix.
inline constexpr std::size_t kGram = 45;

/// What the Jacobians of brightness need.
struct BrightnessJacobian {
  float gain, reference_b;
};

/// Gram matrix of (Jacobian, residual), weighted: sums in single precision over `kSpill` points,
/// of those in double.
struct GramOfInliers {
  static constexpr std::size_t kSpill = 256;

  template <class F>
  SOVO_LANE_FUNCTION static void run(const WarpedArrays& w, std::size_t n,
                                     const BrightnessJacobian& brightness, double* total) {
    alignas(32) F sums[kGram][kParts<F>] = {};
    for (std::size_t i = 0; i < n; i += kTrackedGroup) {
      for (std::size_t part = 0; part < kParts<F>; ++part) {
        const std::size_t at = i + part * lanes_of<F>;
        const F x = load_lane<F>(w.x + at);
        const F y = load_lane<F>(w.y + at);
        const F rho = load_lane<F>(w.rho + at);
        const F gx = load_lane<F>(w.gx + at);
        const F gy = load_lane<F>(w.gy + at);
        const F weight = load_lane<F>(w.weight + at);
        const F along = x * gx + y * gy;
        const F row[9] = {rho * gx,
                          rho * gy,
                          -rho * along,
                          -(gy + y * along),
                          gx + x * along,
                          x * gy - y * gx,
                          brightness.gain * (brightness.reference_b - load_lane<F>(w.colour + at)),
                          lane_of<F>(-1.0F),
                          load_lane<F>(w.residual + at)};
        std::size_t k = 0;
        for (std::size_t a = 0; a < 9; ++a) {
          const F weighted = weight * row[a];
          for (std::size_t b = a; b < 9; ++b) sums[k++][part] += weighted * row[b];
        }
      }
      if ((i + kTrackedGroup) % kSpill == 0 || i + kTrackedGroup == n) spill(&sums[0][0], total);
    }
  }
  template <class F>
  SOVO_LANE_FUNCTION static void spill(F* sums, double* total) {
    for (std::size_t k = 0; k < kGram; ++k) {
      float v[kTrackedGroup];
      __builtin_memcpy(v, &sums[k * kParts<F>], sizeof(v));
      for (std::size_t i = 0; i < kTrackedGroup; i += 4) {
        total[k] += (static_cast<double>(v[i]) + static_cast<double>(v[i + 1])) +
                    (static_cast<double>(v[i + 2]) + static_cast<double>(v[i + 3]));
      }
      for (std::size_t part = 0; part < kParts<F>; ++part) sums[k * kParts<F> + part] = F{};
    }
  }
};

}  // namespace sovo
