#include "sovo/vo/staying_cells.h"

#include <gtest/gtest.h>

#include <numeric>

#include "vo/drive_test_support.h"

namespace sovo {
namespace {

using namespace test;

const ImageCells kCells(16, 64, 64);

/// Points every 4 px of an image of 64x64, at `rho`, and half of it at `lower_rho`.
TrackingReference grid(const ImageF& image, float rho, float lower_rho) {
  TrackingReference reference;
  reference.levels.resize(2);
  for (std::size_t l = 0; l < 2; ++l) {
    ReferenceLevel& level = reference.levels[l];
    const int side = l == 0 ? 64 : 32;
    level.camera = make_camera(side, side, side, side, 0.5 * side, 0.5 * side);
    for (int y = 4; y < side - 4; y += 4) {
      for (int x = 4; x < side - 4; x += 4) {
        level.u.push_back(static_cast<float>(x));
        level.v.push_back(static_cast<float>(y));
        level.rho.push_back(y < side / 2 ? rho : lower_rho);
        level.colour.push_back(l == 0 ? image.at(x, y) : 0.0F);
        level.weight.push_back(1.0F);
      }
    }
  }
  return reference;
}

ImageF steep(double shift_of_upper_half) {
  ImageF image(64, 64);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      const double u = y < 32 ? x + shift_of_upper_half : x;
      image.at(x, y) = static_cast<float>(120.0 + 60.0 * std::sin(0.5 * u) + 0.1 * y);
    }
  }
  return image;
}

int count(const ChosenCells& cells) { return std::reduce(cells.begin(), cells.end(), 0); }

TEST(StayingCellsTest, AreThoseThatLookTheSame) {
  const TrackingReference reference = grid(steep(0.0), 0.5F, 2.0F);
  ImageF image = steep(4.0);
  const ChosenCells staying = staying_cells({}, kCells, reference, image, {});
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(staying[i], 0) << i;
  for (std::size_t i = 8; i < 16; ++i) EXPECT_EQ(staying[i], 1) << i;
  // By the brightness of the image, too.
  apply_brightness(1.4, -20.0, &image);
  BrightnessTransfer transfer;
  transfer.gain = 1.4;
  transfer.bias = -20.0;
  EXPECT_EQ(staying_cells({}, kCells, reference, image, transfer), staying);
  EXPECT_LT(count(staying_cells({}, kCells, reference, image, {})), 8);
}

TEST(StayingCellsTest, PointsBeyondTheImageTellNothing) {
  TrackingReference reference = grid(steep(0.0), 0.5F, 2.0F);
  const ChosenCells before = staying_cells({}, kCells, reference, steep(4.0), {});
  for (const float beyond : {-1e9F, 1.5F, 62.5F, 1e9F}) {
    ReferenceLevel& level = reference.levels[0];
    level.u.push_back(beyond);
    level.v.push_back(beyond);
    level.rho.push_back(1.0F);
    level.colour.push_back(0.0F);
    level.weight.push_back(1.0F);
  }
  EXPECT_EQ(staying_cells({}, kCells, reference, steep(4.0), {}), before);
}

TEST(StayingCellsTest, WhatIsMuchNearerMayBeTheVehicleItself) {
  ChosenCells lower(kCells.size(), 0);
  std::fill(lower.begin() + 8, lower.end(), std::uint8_t{1});
  const auto nearer = [&](float lower_rho) {
    return stays_nearer(kCells, grid(steep(0.0), 0.5F, lower_rho), lower);
  };
  EXPECT_TRUE(nearer(2.0F));
  EXPECT_FALSE(nearer(0.6F)) << "a floor, and what moves above it";
  EXPECT_FALSE(nearer(0.1F)) << "something passes in front of the world";
  const TrackingReference near = grid(steep(0.0), 2.0F, 2.0F);
  EXPECT_FALSE(stays_nearer(kCells, near, ChosenCells(kCells.size(), 1)));
  EXPECT_FALSE(stays_nearer(kCells, near, ChosenCells(kCells.size(), 0)));
}

class CoMovingOfStaying : public ::testing::Test {
 protected:
  CoMovingOfStaying() : lower_(kCells.size(), 0) {
    std::fill(lower_.begin() + 8, lower_.end(), std::uint8_t{1});
  }
  ChosenCells found(float rho, float lower_rho, const SE3& motion) const {
    return co_moving_cells({}, kCells, grid(steep(0.0), rho, lower_rho), motion, lower_);
  }
  ChosenCells lower_;
  SE3 aside_{SO3(), Vec3(0.1, 0.0, 0.0)};
};

TEST_F(CoMovingOfStaying, AreNearerThanTheRest) { EXPECT_EQ(found(0.5F, 2.0F, aside_), lower_); }

TEST_F(CoMovingOfStaying, AreNotAWorldBeforeWhichSomethingMoves) {
  EXPECT_EQ(count(found(2.0F, 0.5F, aside_)), 0);
}

TEST_F(CoMovingOfStaying, AreNotWhatIsTooFarToMove) {
  EXPECT_EQ(count(found(0.5F, 0.1F, aside_)), 0);
  EXPECT_EQ(count(found(0.5F, 2.0F, SE3())), 0);
}

TEST(StayingCellsTest, AReferenceWithoutSomeCellsHasNoPointsThereAtAnyLevel) {
  const TrackingReference reference = grid(steep(0.0), 0.5F, 2.0F);
  ChosenCells chosen(kCells.size(), 0);
  std::fill(chosen.begin() + 8, chosen.end(), std::uint8_t{1});
  const TrackingReference rest = without(reference, kCells, chosen);
  for (std::size_t l = 0; l < 2; ++l) {
    const ReferenceLevel& level = rest.levels[l];
    const ReferenceLevel& all = reference.levels[l];
    const auto upper = static_cast<std::size_t>(
        std::count_if(all.v.begin(), all.v.end(), [l](float v) { return v < (l == 0 ? 32 : 16); }));
    ASSERT_EQ(level.size(), upper);
    for (std::size_t i = 0; i < upper; ++i) {
      EXPECT_EQ(level.u[i], all.u[i]);
      EXPECT_EQ(level.rho[i], 0.5F);
      EXPECT_EQ(level.colour[i], all.colour[i]);
    }
    EXPECT_EQ(level.rho.size(), upper);
  }
}

TEST(StayingCellsTest, WhatWillBeBehindThemIsTakenOutOfAReference) {
  const TrackingReference reference = grid(steep(0.0), 0.5F, 2.0F);
  ChosenCells chosen(kCells.size(), 0);
  std::fill(chosen.begin() + 8, chosen.end(), std::uint8_t{1});
  // By 16 px at 0.5 / m, half of the upper points; the lower ones leave the image.
  const SE3 upwards(SO3(), Vec3(0.0, 0.5, 0.0));
  const TrackingReference rest = without_hidden(reference, kCells, chosen, upwards);
  for (std::size_t l = 0; l < 2; ++l) {
    const float half = l == 0 ? 32.0F : 16.0F;
    std::size_t kept = 0;
    for (const float v : reference.levels[l].v) kept += v < 0.5F * half || v >= half ? 1 : 0;
    EXPECT_EQ(rest.levels[l].size(), kept);
    for (const float v : rest.levels[l].v) EXPECT_TRUE(v < 0.5F * half || v >= half) << v;
  }
  const TrackingReference still = without_hidden(reference, kCells, chosen, SE3());
  EXPECT_EQ(still.levels[0].size(), without(reference, kCells, chosen).levels[0].size());
}

}  // namespace
}  // namespace sovo
