#include "sovo/vo/image_change.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "support/pyramids.h"
#include "support/synthetic_scene.h"

namespace sovo {
namespace {

using namespace test;

constexpr int kViewWidth = 320;
constexpr int kViewHeight = 192;
constexpr double kSensorNoise = 2.0;  ///< [grey levels]

/// Texture of some pixels' grain, and noise; the part above `edge` is moved to the side.
ImagePyramidPtr view(double shift, int edge, unsigned noise_seed) {
  std::mt19937 random(noise_seed);
  std::normal_distribution<float> noise(0.0F, static_cast<float>(kSensorNoise));
  ImageF image(kViewWidth, kViewHeight);
  for (int y = 0; y < kViewHeight; ++y) {
    for (int x = 0; x < kViewWidth; ++x) {
      const double u = y < edge ? x + shift : x;
      const double texture = std::sin(0.31 * u + 0.11 * y) + std::sin(0.23 * y - 0.17 * u) +
                             std::sin(0.05 * u * (1.0 + 0.003 * u));
      image.at(x, y) = static_cast<float>(120.0 + 15.0 * texture) + noise(random);
    }
  }
  return pyramid_of(std::move(image));
}

ImageChange change(double shift, int edge) {
  return image_change(*view(0.0, edge, 1), *view(shift, edge, 2), kSensorNoise);
}

/// Points all over the image, above `edge` at one inverse depth and below at another.
ReferenceLevel points(int edge, float rho_above, float rho_below) {
  ReferenceLevel level;
  for (int y = 4; y < kViewHeight; y += 8) {
    for (int x = 4; x < kViewWidth; x += 8) {
      level.u.push_back(static_cast<float>(x));
      level.v.push_back(static_cast<float>(y));
      level.rho.push_back(y < edge ? rho_above : rho_below);
    }
  }
  return level;
}

TEST(ImageChangeTest, OfACameraAtRestIsNone) {
  for (const double shift : {0.0, 0.7, 1.5}) {
    const ImageChange rest = change(shift, kViewHeight);
    EXPECT_GT(rest.textured, 50);
    EXPECT_GT(std::ranges::count(rest.same, 1), 50);
    EXPECT_EQ(rest.share(), 0.0) << shift;
    EXPECT_FALSE(may_deny_rest(rest));
  }
}

TEST(ImageChangeTest, IsNoneWhereFineTextureLiesAPixelAside) {
  const auto fine = [](int shift) {
    ImageF image(kViewWidth, kViewHeight);
    for (int y = 0; y < kViewHeight; ++y) {
      for (int x = 0; x < kViewWidth; ++x) {
        const double grain = 20.0 * std::sin(2.1 * (x + shift));
        image.at(x, y) =
            static_cast<float>(120.0 + grain + 17.0 * std::sin(0.3 * (x + shift) + 0.2 * y));
      }
    }
    return pyramid_of(std::move(image));
  };
  const ImageChange aside = image_change(*fine(0), *fine(1), kSensorNoise);
  EXPECT_GT(aside.textured, 50);
  EXPECT_EQ(aside.share(), 0.0);
}

TEST(ImageChangeTest, OfFewCellsIsNoneHoweverFewHaveTexture) {
  const auto corner = [](double shift) {
    const ImagePyramidPtr textured = view(shift, 32, 1);
    ImageF image(kViewWidth, kViewHeight);
    std::fill_n(image.data(), kViewWidth * kViewHeight, 90.0F);
    for (int y = 0; y < 32; ++y) std::copy_n(textured->level(0).row(y), 96, image.row(y));
    return pyramid_of(std::move(image));
  };
  const ImageChange few = image_change(*corner(0.0), *corner(23.0), kSensorNoise);
  EXPECT_EQ(few.textured, 3);
  EXPECT_GT(std::ranges::count(few.different, 1), 0);
  EXPECT_EQ(few.share(), 0.0);
}

TEST(ImageChangeTest, IsNoneByOtherLight) {
  ImageF image = view(0.0, kViewHeight, 2)->level(0);
  apply_brightness(0.7, 25.0, &image);
  const ImageChange darker =
      image_change(*view(0.0, kViewHeight, 1), *pyramid_of(image), kSensorNoise);
  EXPECT_EQ(darker.share(), 0.0);
}

TEST(ImageChangeTest, IsNoneWhereThereIsNothingButNoise) {
  const auto blank = [](unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<float> noise(90.0F, static_cast<float>(kSensorNoise));
    ImageF image(kViewWidth, kViewHeight);
    for (int i = 0; i < kViewWidth * kViewHeight; ++i) image.data()[i] = noise(random);
    return pyramid_of(std::move(image));
  };
  const ImageChange nothing = image_change(*blank(1), *blank(2), kSensorNoise);
  EXPECT_EQ(nothing.textured, 0);
  EXPECT_EQ(nothing.share(), 0.0);
}

TEST(ImageChangeTest, BeyondABodyThatStaysDeniesRest) {
  const ImageChange moved = change(23.0, 96);
  EXPECT_GT(moved.share(), 0.2);
  EXPECT_TRUE(may_deny_rest(moved));
  EXPECT_TRUE(denies_rest(moved, points(96, 0.3F, 2.0F)));
  // Of what moves nothing may be known.
  ReferenceLevel body = points(0, 0.3F, 2.0F);
  std::ranges::replace_if(
      body.v, [](float v) { return v < 96.0F; }, 150.0F);
  EXPECT_TRUE(denies_rest(moved, body));
}

TEST(ImageChangeTest, BeforeAWorldThatStaysDoesNot) {
  const ImageChange passing = change(23.0, 96);
  EXPECT_TRUE(may_deny_rest(passing)) << "its share is the same";
  EXPECT_FALSE(denies_rest(passing, points(96, 2.0F, 0.3F)));
}

TEST(ImageChangeTest, OfASmallPartDoesNot) {
  const ImagePyramidPtr before = view(0.0, 32, 1);
  const ImagePyramidPtr moved = view(23.0, 32, 2);
  ImageF image = view(0.0, 32, 2)->level(0);
  for (int y = 0; y < 32; ++y) std::copy_n(moved->level(0).row(y), 96, image.row(y));
  const ImageChange little = image_change(*before, *pyramid_of(image), kSensorNoise);
  EXPECT_GT(std::ranges::count(little.different, 1), 0);
  EXPECT_FALSE(may_deny_rest(little));
  EXPECT_FALSE(denies_rest(little, points(32, 0.3F, 2.0F)));
}

}  // namespace
}  // namespace sovo
