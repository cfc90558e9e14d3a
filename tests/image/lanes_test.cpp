#include "sovo/image/lanes.h"

#include <gtest/gtest.h>

#include <algorithm>
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

}  // namespace
}  // namespace sovo
