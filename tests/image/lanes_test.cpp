#include "sovo/image/lanes.h"

#include <gtest/gtest.h>

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
    const LaneSample lanes = sample_lanes_with_gradient(image, x, y);
    for (int i = 0; i < 4; ++i) {
      ASSERT_TRUE(in_image(image, x[i], y[i]));
      const Sample s = sample_with_gradient(image, x[i], y[i]);
      EXPECT_EQ(lanes.value[i], s.value);
      EXPECT_EQ(lanes.gx[i], s.gx);
      EXPECT_EQ(lanes.gy[i], s.gy);
    }
  }
}

}  // namespace
}  // namespace sovo
