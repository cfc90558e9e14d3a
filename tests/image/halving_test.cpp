#include "sovo/image/halving.h"

#include <gtest/gtest.h>

#include "support/cameras.h"

namespace sovo {
namespace {

TEST(Halving, TakesTheMeanOfEachBlockAndCutsWhatIsOdd) {
  ImageF image(5, 3);
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 5; ++x) image.at(x, y) = static_cast<float>(x * x + 10 * y);
  }
  ImageF half;
  halve(image, &half);
  ASSERT_EQ(half.width(), 2);
  ASSERT_EQ(half.height(), 1);
  EXPECT_FLOAT_EQ(half.at(0, 0), (0 + 1 + 10 + 11) / 4.0F);
  EXPECT_FLOAT_EQ(half.at(1, 0), (4 + 9 + 14 + 19) / 4.0F);
}

TEST(Halving, AReducedMaskAllowsWhatAllItsPixelsAllow) {
  ImageU8 mask(9, 8);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 9; ++x) mask.at(x, y) = 255;
  }
  mask.at(5, 6) = 0;
  const ImageU8 quarter = reduced_mask(mask, 4);
  ASSERT_EQ(quarter.width(), 2);
  ASSERT_EQ(quarter.height(), 2);
  EXPECT_EQ(quarter.at(0, 0), 255);
  EXPECT_EQ(quarter.at(1, 0), 255);
  EXPECT_EQ(quarter.at(0, 1), 255);
  EXPECT_EQ(quarter.at(1, 1), 0);
  EXPECT_TRUE(reduced_mask(ImageU8(), 2).empty());
}

TEST(Halving, PositionsLieWhereTheHalvedCameraHasThem) {
  const CameraModel whole = test::make_camera(640, 400, 450, 440, 322, 197);
  const Vec3 point(0.4, -0.3, 2.0);
  for (int halvings = 0; halvings <= 3; ++halvings) {
    const Vec2 halved = *whole.at_level(halvings).project(point);
    const Vec2 expected = *whole.project(point);
    EXPECT_NEAR(from_halved(static_cast<float>(halved.x()), halvings), expected.x(), 1e-4);
    EXPECT_NEAR(from_halved(static_cast<float>(halved.y()), halvings), expected.y(), 1e-4);
  }
}

}  // namespace
}  // namespace sovo
