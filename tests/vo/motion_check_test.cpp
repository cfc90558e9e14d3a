#include "sovo/vo/motion_check.h"

#include <gtest/gtest.h>

#include <random>

#include "sovo/image/interpolation.h"
#include "vo/drive_test_support.h"

namespace sovo {
namespace {

using namespace test;

constexpr int kViewSide = 128;

/// Waves that are alike nowhere within a few pixels.
double two_waves(double x, double y) {
  return 120.0 + 40.0 * std::sin(0.37 * x + 0.11 * y) + 30.0 * std::cos(0.23 * y - 0.31 * x);
}

/// An image whose rows from `fixed_from` on stay, while the others move by `shift` [px].
ImageF moved_image(double shift, int fixed_from = kViewSide) {
  ImageF image(kViewSide, kViewSide);
  for (int y = 0; y < kViewSide; ++y) {
    for (int x = 0; x < kViewSide; ++x) {
      image.at(x, y) = static_cast<float>(two_waves(y < fixed_from ? x - shift : x, y));
    }
  }
  return image;
}

/// The same image without texture in its lower half.
ImageF flat_below(ImageF image) {
  for (int y = kViewSide / 2; y < kViewSide; ++y) {
    for (int x = 0; x < kViewSide; ++x) image.at(x, y) = 100.0F;
  }
  return image;
}

void add_noise(double sigma, unsigned seed, ImageF* image) {
  std::mt19937 random(seed);
  std::normal_distribution<float> noise(0.0F, static_cast<float>(sigma));
  for (int i = 0; i < kViewSide * kViewSide; ++i) image->data()[i] += noise(random);
}

/// Points every 4 px, a metre away: a metre to the side is as many pixels as the image has.
TrackingReference points_of(const ImageF& image) {
  TrackingReference reference;
  ReferenceLevel& level = reference.levels.emplace_back();
  level.camera = make_camera(kViewSide, kViewSide, kViewSide, kViewSide, 64.0, 64.0);
  for (int y = 4; y < kViewSide; y += 4) {
    for (int x = 4; x < kViewSide; x += 4) {
      level.u.push_back(static_cast<float>(x));
      level.v.push_back(static_cast<float>(y));
      level.rho.push_back(1.0F);
      level.colour.push_back(image.at(x, y));
      level.weight.push_back(1.0F);
    }
  }
  return reference;
}

SE3 aside(double px) { return {SO3(), Vec3(px / kViewSide, 0.0, 0.0)}; }

class MotionCheckTest : public ::testing::Test {
 protected:
  MotionEvidence evidence(const ImageF& image, double px, const BrightnessTransfer& transfer = {}) {
    return check_.of(points_of(first_), image, aside(px), transfer);
  }
  ImageF first_ = moved_image(0.0);
  MotionCheck check_{CoMovingConfig(), kViewSide, kViewSide};
};

TEST_F(MotionCheckTest, ARightMotionIsBorneOut) {
  const MotionEvidence seen = evidence(moved_image(4.0), 4.0);
  EXPECT_GT(seen.expected, 0.9);
  EXPECT_GT(seen.moved, 0.95 * seen.expected);
  EXPECT_EQ(seen.in_place, 0.0);
  EXPECT_FALSE(seen.is_doubtful() || seen.is_missing());
}

TEST_F(MotionCheckTest, BrightnessIsNoMotion) {
  ImageF image = moved_image(4.0);
  apply_brightness(1.5, -30.0, &image);
  BrightnessTransfer transfer;
  transfer.gain = 1.5;
  transfer.bias = -30.0;
  const MotionEvidence seen = evidence(image, 4.0, transfer);
  EXPECT_GT(seen.moved, 0.95 * seen.expected);
  EXPECT_LT(evidence(image, 4.0).moved, 0.8 * seen.moved);
}

TEST_F(MotionCheckTest, AMotionBetweenThoseOfTwoThingsIsDoubtful) {
  // Half of the image stays, the other moves by 6 px; both are 3 px off.
  const MotionEvidence seen = evidence(moved_image(6.0, 64), 3.0);
  EXPECT_NEAR(seen.in_place, 0.5, 0.06);
  EXPECT_TRUE(seen.is_doubtful());
}

TEST_F(MotionCheckTest, WhatPassesByOrMovesAlongInASmallPartIsNotDoubtful) {
  // Two rows of squares of eight are not doubted by three hundredths of the points, one is.
  const MotionEvidence seen = evidence(moved_image(4.0, 124), 4.0);
  EXPECT_LT(seen.in_place, 0.05);
  EXPECT_FALSE(seen.is_doubtful() || seen.is_missing());
  EXPECT_TRUE(evidence(moved_image(4.0, 112), 4.0).is_doubtful());
}

TEST_F(MotionCheckTest, ALoneSquareStaysByChance) {
  ImageF image = moved_image(4.0);
  for (int y = 48; y < 64; ++y) std::copy_n(first_.row(y) + 48, 16, image.row(y) + 48);
  EXPECT_EQ(evidence(image, 4.0).in_place, 0.0);
  for (int y = 48; y < 64; ++y) std::copy_n(first_.row(y) + 48, 32, image.row(y) + 48);
  EXPECT_GT(evidence(image, 4.0).in_place, 0.0) << "two of them";
}

TEST_F(MotionCheckTest, AWrongMotionIsMissing) {
  const MotionEvidence seen = evidence(moved_image(-7.0), 4.0);
  EXPECT_GT(seen.expected, 0.9);
  EXPECT_TRUE(seen.is_missing());
}

TEST_F(MotionCheckTest, NoiseAsStrongAsTheTextureDoesNotHideARightMotion) {
  ImageF image = moved_image(5.0);
  add_noise(15.0, 1, &image);
  add_noise(15.0, 2, &first_);
  const MotionEvidence seen = evidence(image, 5.0);
  EXPECT_FALSE(seen.is_doubtful() || seen.is_missing()) << seen.moved << " of " << seen.expected;
  EXPECT_TRUE(evidence(image, -6.0).is_missing());
}

TEST_F(MotionCheckTest, WhatHardlyMovesTellsNothing) {
  const MotionEvidence seen = evidence(first_, 1.9);
  EXPECT_EQ(seen.expected, 0.0);
  EXPECT_FALSE(seen.is_doubtful() || seen.is_missing());
}

TEST_F(MotionCheckTest, NorDoesWhatIsOutOfViewOrBehind) {
  EXPECT_LT(evidence(moved_image(100.0), 100.0).expected, 0.25);
  const MotionEvidence behind =
      check_.of(points_of(first_), first_, SE3(SO3(), Vec3(0.0, 0.0, -2.0)), {});
  EXPECT_EQ(behind.expected, 0.0);
  EXPECT_FALSE(behind.is_doubtful() || behind.is_missing());
  TrackingReference beyond = points_of(first_);
  for (const float place : {-1e9F, 127.5F, 1e9F}) {
    ReferenceLevel& level = beyond.levels[0];
    level.u.push_back(place);
    level.v.push_back(place);
    level.rho.push_back(1.0F);
    level.colour.push_back(0.0F);
    level.weight.push_back(1.0F);
  }
  EXPECT_GT(check_.of(beyond, moved_image(4.0), aside(4.0), {}).moved, 0.9);
  TrackingReference none;
  none.levels.resize(1);
  EXPECT_EQ(check_.of(none, first_, SE3(), {}).expected, 0.0);
}

TEST_F(MotionCheckTest, AsMuchAgreesAsIsWhereTheMotionTakesIt) {
  const auto share = [this](const ImageF& image, double px) {
    return agreeing_share(CoMovingConfig(), points_of(first_), image, aside(px), {});
  };
  EXPECT_GT(share(moved_image(4.0), 4.0), 0.95);
  EXPECT_LT(share(moved_image(4.0), 0.0), 0.3);
  EXPECT_LT(share(moved_image(4.0), 2.0), 0.3) << "between both";
  // The lower half stays.
  EXPECT_NEAR(share(moved_image(4.0, 64), 0.0), 0.5, 0.15);
  EXPECT_NEAR(share(moved_image(4.0, 64), 4.0), 0.5, 0.15);
  EXPECT_LT(share(moved_image(4.0, 64), 2.0), 0.3);
  // What has no texture agrees with any motion, and does not count.
  const ImageF moved = flat_below(moved_image(4.0));
  const TrackingReference points = points_of(flat_below(first_));
  EXPECT_GT(agreeing_share(CoMovingConfig(), points, moved, aside(4.0), {}), 0.95);
  EXPECT_LT(agreeing_share(CoMovingConfig(), points, moved, SE3(), {}), 0.3);
}

}  // namespace
}  // namespace sovo
