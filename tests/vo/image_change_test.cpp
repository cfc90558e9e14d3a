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

/// Texture of some pixels' grain, and noise; the part above `edge` is moved to the side, and haze
/// leaves `clear` of its contrast.
ImagePyramidPtr view(double shift, int edge, unsigned noise_seed, double clear = 1.0) {
  std::mt19937 random(noise_seed);
  std::normal_distribution<float> noise(0.0F, static_cast<float>(kSensorNoise));
  ImageF image(kViewWidth, kViewHeight);
  for (int y = 0; y < kViewHeight; ++y) {
    for (int x = 0; x < kViewWidth; ++x) {
      const double u = y < edge ? x + shift : x;
      const double texture = std::sin(0.31 * u + 0.11 * y) + std::sin(0.23 * y - 0.17 * u) +
                             std::sin(0.05 * u * (1.0 + 0.003 * u));
      const double contrast = y < edge ? 15.0 * clear : 15.0;
      image.at(x, y) = static_cast<float>(120.0 + contrast * texture) + noise(random);
    }
  }
  return pyramid_of(std::move(image));
}

ImageChange change(double shift, int edge) {
  return image_change(*view(0.0, edge, 1), *view(shift, edge, 2), kSensorNoise, 1);
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
  const ImageChange aside = image_change(*fine(0), *fine(1), kSensorNoise, 1);
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
  const ImageChange few = image_change(*corner(0.0), *corner(23.0), kSensorNoise, 1);
  EXPECT_EQ(few.textured, 3);
  EXPECT_GT(std::ranges::count(few.different, 1), 0);
  EXPECT_EQ(few.share(), 0.0);
}

TEST(ImageChangeTest, IsNoneByOtherLight) {
  ImageF image = view(0.0, kViewHeight, 2)->level(0);
  apply_brightness(0.7, 25.0, &image);
  const ImageChange darker =
      image_change(*view(0.0, kViewHeight, 1), *pyramid_of(image), kSensorNoise, 1);
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
  const ImageChange nothing = image_change(*blank(1), *blank(2), kSensorNoise, 1);
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

TEST(ImageChangeTest, OfAWorldInHazeShowsInSmallerImages) {
  const auto hazy = [](double shift, int halvings) {
    return image_change(*view(0.0, 144, 1, 0.14), *view(shift, 144, 2, 0.14), kSensorNoise,
                        halvings);
  };
  const ReferenceLevel world_and_body = points(144, 0.3F, 2.0F);
  EXPECT_FALSE(may_deny_rest(hazy(23.0, 1))) << "whole images show it, and the test nothing";
  EXPECT_TRUE(may_deny_rest(hazy(23.0, 2)));
  EXPECT_TRUE(denies_rest(hazy(23.0, 2), world_and_body));
  for (const double shift : {0.0, 0.7, 1.5}) {
    const ImageChange rest = hazy(shift, 2);
    EXPECT_GE(std::ranges::count(rest.same, 1), 8);
    EXPECT_FALSE(may_deny_rest(rest)) << shift;
  }
}

TEST(ImageChangeTest, IsNoneWhereThereIsNothingButNoiseInSmallerImages) {
  const ImageChange nothing = image_change(*view(0.0, kViewHeight, 1, 0.0),
                                           *view(0.0, kViewHeight, 2, 0.0), kSensorNoise, 2);
  EXPECT_EQ(nothing.textured, 0);
  EXPECT_FALSE(may_deny_rest(nothing));
}

TEST(RestDenialTest, HoldsUntilWhatWasDifferentLooksAsBefore) {
  const ReferenceLevel level = points(96, 0.3F, 2.0F);
  const ImagePyramidPtr before = view(0.0, 96, 1);
  const auto since = [&](const ImagePyramidPtr& image) {
    return image_change(*before, *image, kSensorNoise, 1);
  };
  const ImageChange same = since(view(0.0, 96, 2));
  const ImageChange moved = since(view(23.0, 96, 2));
  ImageChange faint = moved;  // of a frame in which the world hardly shows
  std::ranges::fill(faint.different, 0);
  RestDenial denial;
  EXPECT_FALSE(denial.holds(same, level, 7, 1));
  EXPECT_FALSE(denial.holds(faint, level, 7, 1));
  EXPECT_TRUE(denial.holds(moved, level, 7, 1));
  EXPECT_TRUE(denial.holds(faint, level, 7, 1));
  EXPECT_FALSE(denial.holds(faint, level, 7, 2)) << "of images of another size";
  EXPECT_FALSE(denial.holds(same, level, 7, 1));
  EXPECT_FALSE(denial.holds(faint, level, 7, 1)) << "it was over";
  EXPECT_TRUE(denial.holds(moved, level, 7, 1));
  EXPECT_FALSE(denial.holds(faint, level, 8, 1)) << "against another keyframe";
  EXPECT_TRUE(denial.holds(moved, level, 8, 1));
  denial.clear();
  EXPECT_FALSE(denial.holds(faint, level, 8, 1));
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
  const ImageChange little = image_change(*before, *pyramid_of(image), kSensorNoise, 1);
  EXPECT_GT(std::ranges::count(little.different, 1), 0);
  EXPECT_FALSE(may_deny_rest(little));
  EXPECT_FALSE(denies_rest(little, points(32, 0.3F, 2.0F)));
}

}  // namespace
}  // namespace sovo
