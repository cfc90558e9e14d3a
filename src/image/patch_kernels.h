#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "sovo/geometry/types.h"
#include "sovo/image/lanes.h"
#include "sovo/image/patch_correlation.h"

namespace sovo {

using Vec2f = Eigen::Vector2f;
using Mat2f = Eigen::Matrix2f;

inline constexpr int kHalfAlong = kPatchAlong / 2;
inline constexpr int kHalfAcross = kPatchAcross / 2;
/// Steps between exact projections, and steps that share one warp of the base patch; whole lanes.
inline constexpr int kNodeSteps = 8;
inline constexpr int kSegmentSteps = 24;

/// Steps along and across of each pixel of a grid; along is the slow index. Filled up to whole
/// lanes with the centre.
template <int kHalfS, int kHalfT>
struct Grid {
  static constexpr std::size_t kSize =
      static_cast<std::size_t>((2 * kHalfS + 1) * (2 * kHalfT + 1));
  static constexpr std::size_t kPadded = (kSize + kWideLanes - 1) / kWideLanes * kWideLanes;
  alignas(32) std::array<float, kPadded> s{}, t{};
  constexpr Grid() {
    std::size_t k = 0;
    for (int i = -kHalfS; i <= kHalfS; ++i) {
      for (int j = -kHalfT; j <= kHalfT; ++j, ++k) {
        s[k] = static_cast<float>(i);
        t[k] = static_cast<float>(j);
      }
    }
  }
};

/// Samples of a grid: center + i s + j t.
template <int kHalfS, int kHalfT>
struct SampleGrid {
  template <class F>
  SOVO_LANE_FUNCTION static void run(const ImageF& image, const Vec2f& center, const Vec2f& s,
                                     const Vec2f& t, float* values) {
    constexpr Grid<kHalfS, kHalfT> kGrid;
    // Those that fill up the last lanes are not needed.
    for (std::size_t k = 0; k < kGrid.kSize; k += lanes_of<F>) {
      const F i = load_lane<F>(&kGrid.s[k]);
      const F j = load_lane<F>(&kGrid.t[k]);
      store_lane(sample_lanes(image, F(center.x() + i * s.x() + j * t.x()),
                              F(center.y() + i * s.y() + j * t.y())),
                 values + k);
    }
  }
};

/// The pixels of a patch, along is the slow index, and zeros behind them up to whole lanes.
using Patch = std::array<float, Grid<kHalfAlong, kHalfAcross>::kPadded>;

/// Target image along the curve: one column of kPatchAcross pixels a step, stored by rows, with
/// whole lanes of unseen columns behind the last.
struct Strip {
  static constexpr int kColumns = CorrelationProfile::kCapacity + kPatchAlong - 1;
  static constexpr std::size_t kStride = kColumns + 4 * kWideLanes;
  int size = 0;
  std::array<std::array<float, kStride>, kPatchAcross> rows;
  std::array<float, kStride> sum, energy, rho;
  std::array<std::int32_t, kStride> seen;  ///< -1 or 0.
};
static_assert(kNodeSteps % kWideLanes == 0 && kSegmentSteps % kWideLanes == 0);

/// Columns from a pixel on, in steps.
struct ColumnRun {
  Vec2f from, step, across;
};

/// Writes `count` columns from column k on, and up to whole lanes more.
struct SampleColumns {
  template <class F>
  SOVO_LANE_FUNCTION static void run(const ImageF& image, const ColumnRun& columns, int count,
                                     std::size_t k, Strip* strip) {
    const Vec2f reach = kHalfAcross * columns.across.cwiseAbs();
    const F zero = lane_of<F>(0.0F);
    for (int begin = 0; begin < count; begin += static_cast<int>(lanes_of<F>)) {
      const F index = lane_index<F>() + static_cast<float>(begin);
      const F x = columns.from.x() + index * columns.step.x();
      const F y = columns.from.y() + index * columns.step.y();
      const MaskOf<F> seen = (x >= reach.x()) & (y >= reach.y()) &
                             (x < static_cast<float>(image.width() - 1) - reach.x()) &
                             (y < static_cast<float>(image.height() - 1) - reach.y());
      F sum = zero;
      F energy = zero;
      for (int j = 0; j < kPatchAcross; ++j) {
        const auto offset = static_cast<float>(j - kHalfAcross);
        // A pixel that can be read, where the column is not seen.
        const F u = x + offset * columns.across.x();
        const F v = y + offset * columns.across.y();
        const F value = sample_lanes(image, F(seen ? u : zero), F(seen ? v : zero));
        store_lane(value, &strip->rows[static_cast<std::size_t>(j)][k]);
        sum += value;
        energy += value * value;
      }
      store_lane(sum, &strip->sum[k]);
      store_lane(energy, &strip->energy[k]);
      store_mask(seen, &strip->seen[k]);
      k += lanes_of<F>;
    }
  }
};

/// Correlation of the patch with the windows that begin at the columns from `begin` to `end`, and
/// up to whole lanes more.
struct WindowScores {
  template <class F>
  SOVO_LANE_FUNCTION static void run(const Strip& strip, const Patch& patch, int begin, int end,
                                     float* score) {
    for (int at = begin; at < end; at += static_cast<int>(lanes_of<F>)) {
      const auto first = static_cast<std::size_t>(at);
      F sum{};
      F energy{};
      MaskOf<F> seen = ~MaskOf<F>{};
      F products[kPatchAcross] = {};
      for (std::size_t i = 0; i < kPatchAlong; ++i) {
        sum += load_lane<F>(&strip.sum[first + i]);
        energy += load_lane<F>(&strip.energy[first + i]);
        seen &= load_mask<MaskOf<F>>(&strip.seen[first + i]);
        for (std::size_t j = 0; j < kPatchAcross; ++j) {
          products[j] += patch[i * kPatchAcross + j] * load_lane<F>(&strip.rows[j][first + i]);
        }
      }
      F product = products[0];
      for (std::size_t j = 1; j < kPatchAcross; ++j) product += products[j];
      const F variance = energy - sum * sum / static_cast<float>(kPatchSize);
      const F zero = lane_of<F>(0.0F);
      const F visible = variance < 1e-2F * kPatchSize ? zero : F(product / sqrt_lane(variance));
      store_lane(F(seen ? visible : lane_of<F>(CorrelationProfile::kUnseen)), score + first);
    }
  }
};

}  // namespace sovo
