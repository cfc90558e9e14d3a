#include "sovo/vo/likeness.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace sovo {
namespace {

constexpr int kImageSide = 48;
constexpr double kResiduals = 2.0;  ///< RMS [grey levels].

ImageF waves(double shift, double gain, double bias) {
  ImageF image(kImageSide, kImageSide);
  for (int y = 0; y < kImageSide; ++y) {
    for (int x = 0; x < kImageSide; ++x) {
      const double wave = std::sin(0.4 * (x + shift) + 0.1 * y);
      image.at(x, y) = static_cast<float>(gain * (100.0 + 20.0 * wave) + bias);
    }
  }
  return image;
}

ImageF noise(unsigned seed, float mean) {
  std::mt19937 random(seed);
  std::normal_distribution<float> value(mean, 1.0F);
  ImageF image(kImageSide, kImageSide);
  for (int i = 0; i < kImageSide * kImageSide; ++i) image.data()[i] = value(random);
  return image;
}

TEST(LikenessTest, WhatIsLitInAnotherWayIsTheSame) {
  const Likeness l = likeness(waves(0.0, 1.0, 0.0), waves(0.0, 0.6, 30.0), 8, 8, 32);
  EXPECT_NEAR(l.correlation, 1.0, 1e-6);
  EXPECT_NEAR(l.contrast, 20.0 / std::sqrt(2.0), 1.0) << "that of the brighter one";
  EXPECT_TRUE(l.is_same());
  EXPECT_FALSE(l.is_different(kResiduals));
}

TEST(LikenessTest, WhatHasMovedIsDifferent) {
  const Likeness l = likeness(waves(0.0, 1.0, 0.0), waves(7.0, 1.0, 0.0), 8, 8, 32);
  EXPECT_FALSE(l.is_same());
  EXPECT_TRUE(l.is_different(kResiduals));
}

TEST(LikenessTest, NoiseIsNeitherWhateverItsBrightness) {
  const Likeness l = likeness(noise(1, 90.0F), noise(2, 150.0F), 8, 8, 32);
  EXPECT_LT(std::abs(l.correlation), 0.4);
  EXPECT_NEAR(l.difference, std::sqrt(2.0), 0.3) << "but for the mean";
  EXPECT_FALSE(l.is_same());
  EXPECT_FALSE(l.is_different(kResiduals));
}

TEST(LikenessTest, WhatLiesBeyondTheImagesDoesNotCount) {
  const ImageF a = waves(0.0, 1.0, 0.0);
  const ImageF b = waves(7.0, 1.0, 0.0);
  const Likeness inside = likeness(a, b, 32, 32, 16);
  const Likeness over = likeness(a, b, 32, 32, 64);
  EXPECT_EQ(over.correlation, inside.correlation);
  EXPECT_EQ(over.difference, inside.difference);
}

}  // namespace
}  // namespace sovo
