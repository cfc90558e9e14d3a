#include "sovo/image/lanes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "sovo/image/interpolation.h"

namespace sovo {
namespace {

TEST(Lanes, TransposeSwapsRowsAndColumns) {
  Lane rows[4];
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) rows[i][j] = static_cast<float>(10 * i + j);
  }
  transpose(&rows[0], &rows[1], &rows[2], &rows[3]);
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) EXPECT_EQ(rows[i][j], static_cast<float>(10 * j + i));
  }
}

TEST(Lanes, ArithmeticIsTheScalarOneBitForBit) {
  std::mt19937 random(5);
  for (int trial = 0; trial < 200; ++trial) {
    Lane v[4];
    for (Lane& lane : v) {
      for (int i = 0; i < 4; ++i) {
        lane[i] = static_cast<float>(random() % 20001) / 100.0F - 100.0F;
      }
    }
    const Lane sums = sum_lanes(v[0], v[1], v[2], v[3]);
    const Lane least = min_lane(v[0], v[1]);
    const Lane magnitude = abs_lane(v[0]);
    const Lane root = sqrt_lane(magnitude);
    for (int i = 0; i < 4; ++i) {
      EXPECT_EQ(sums[i], (v[i][0] + v[i][1]) + (v[i][2] + v[i][3]));
      EXPECT_EQ(least[i], std::min(v[0][i], v[1][i]));
      EXPECT_EQ(magnitude[i], std::abs(v[0][i]));
      EXPECT_EQ(root[i], std::sqrt(std::abs(v[0][i])));
    }
    EXPECT_TRUE(all_of(magnitude >= v[0]));
    EXPECT_TRUE(none_of(magnitude < v[0]));
    const LaneMask below = v[0] < v[1];
    EXPECT_EQ(all_of(below),
              v[0][0] < v[1][0] && v[0][1] < v[1][1] && v[0][2] < v[1][2] && v[0][3] < v[1][3]);
    EXPECT_EQ(none_of(below),
              !(v[0][0] < v[1][0] || v[0][1] < v[1][1] || v[0][2] < v[1][2] || v[0][3] < v[1][3]));
  }
}

TEST(Lanes, SamplesAreTheScalarOnesBitForBit) {
  std::mt19937 random(3);
  ImageF image(37, 29);
  for (std::size_t i = 0; i < image.size(); ++i) {
    image.data()[i] = static_cast<float>(random() % 25600) / 100.0F;
  }
  for (int trial = 0; trial < 200; ++trial) {
    float x[4];
    float y[4];
    for (int i = 0; i < 4; ++i) {
      x[i] = 1.0F + 33.9F * static_cast<float>(random() % 1000) / 1000.0F;
      y[i] = 1.0F + 25.9F * static_cast<float>(random() % 1000) / 1000.0F;
    }
    const LaneSample lanes = sample_lanes_with_gradient(image, load_lane(x), load_lane(y));
    const Lane values = sample_lanes(image, load_lane(x), load_lane(y));
    for (int i = 0; i < 4; ++i) {
      ASSERT_TRUE(in_image(image, x[i], y[i]));
      EXPECT_EQ(values[i], sample(image, x[i], y[i]));
      const Sample s = sample_with_gradient(image, x[i], y[i]);
      EXPECT_EQ(lanes.value[i], s.value);
      EXPECT_EQ(lanes.gx[i], s.gx);
      EXPECT_EQ(lanes.gy[i], s.gy);
    }
  }
}

/// The functions of lanes at random values, as numbers one after the other.
struct TryLanes {
  template <class F>
  SOVO_LANE_FUNCTION static void run(const ImageF& image, const float* x, const float* y,
                                     float* out) {
    float* to = out;
    for (std::size_t i = 0; i < kWideLanes; i += lanes_of<F>, to += lanes_of<F>) {
      const F u = load_lane<F>(x + i);
      const F v = load_lane<F>(y + i);
      const auto s = sample_lanes_with_gradient(image, u, v);
      store_lane(sample_lanes(image, u, v), to);
      store_lane(s.value, to + 8);
      store_lane(s.gx, to + 16);
      store_lane(s.gy, to + 24);
      store_lane(sqrt_lane(u), to + 32);
      store_lane(min_lane(u, v), to + 40);
      store_lane(abs_lane(F(u - v)), to + 48);
      store_lane(F(u < v ? u * v : u / v), to + 56);
      store_lane(F(lane_index<F>() + static_cast<float>(i)), to + 64);
    }
    F values[8][kWideLanes / lanes_of<F>];
    F sums[8] = {};
    for (std::size_t k = 0; k < 8; ++k) {
      for (std::size_t i = 0; i < kWideLanes; i += lanes_of<F>) {
        values[k][i / lanes_of<F>] = load_lane<F>(out + 8 * k + i);
      }
      sums[k] = values[k][0];
      for (std::size_t i = lanes_of<F>; i < kWideLanes; i += lanes_of<F>) {
        sums[k] += values[k][i / lanes_of<F>];
      }
    }
    store_sums(sums, out + 72);
    const F first = load_lane<F>(x);
    out[80] = all_of(MaskOf<F>(first > 0.5F)) ? 1.0F : 0.0F;
    out[81] = none_of(MaskOf<F>(first < 0.5F)) ? 1.0F : 0.0F;
  }
};

TEST(Lanes, EightGiveTheBitsOfFour) {
  if (!has_wide_lanes()) GTEST_SKIP() << "this processor has no registers of eight lanes";
  std::mt19937 random(8);
  ImageF image(37, 29);
  for (std::size_t i = 0; i < image.size(); ++i) {
    image.data()[i] = static_cast<float>(random() % 25600) / 100.0F;
  }
  for (int trial = 0; trial < 200; ++trial) {
    std::array<float, kWideLanes> x;
    std::array<float, kWideLanes> y;
    for (std::size_t i = 0; i < kWideLanes; ++i) {
      x[i] = 1.0F + 33.9F * static_cast<float>(random() % 1000) / 1000.0F;
      y[i] = 1.0F + 25.9F * static_cast<float>(random() % 1000) / 1000.0F;
    }
    std::array<float, 82> four{};
    std::array<float, 82> eight{};
    run_narrow<TryLanes>(image, x.data(), y.data(), four.data());
    run_wide<TryLanes>(image, x.data(), y.data(), eight.data());
    EXPECT_EQ(four, eight);
    EXPECT_EQ(four[71], 7.0F);
    if (!has_avx512()) continue;
    eight = {};
    run_avx512<TryLanes>(image, x.data(), y.data(), eight.data());
    EXPECT_EQ(four, eight);
  }
}

}  // namespace
}  // namespace sovo
