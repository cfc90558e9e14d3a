#include "sovo/image/corners.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace sovo {
namespace {

/// White squares of 16 px on black, 32 px apart.
ImageF squares(int width, int height) {
  ImageF image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image.at(x, y) = (x / 16) % 2 == 1 && (y / 16) % 2 == 1 ? 200.0F : 0.0F;
    }
  }
  return image;
}

TEST(Corners, AreWhereTwoEdgesMeetAndNotAlongOne) {
  const ImageF response = corner_response(squares(128, 96));
  EXPECT_GT(response.at(16, 16), 1000.0F);
  EXPECT_LT(response.at(24, 16), 1e-3F) << "an edge";
  EXPECT_EQ(response.at(24, 24), 0.0F) << "inside a square";
  EXPECT_EQ(response.at(1, 16), 0.0F) << "at the edge of the image";
}

TEST(Corners, AreLocalMaximaSpreadOverTheImageTheStrongestFirst) {
  ImageF image = squares(256, 192);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 128; x < image.width(); ++x) image.at(x, y) *= 0.3F;  // weaker on the right
  }
  const ImageF response = corner_response(image);
  const auto corners = spread_corners(response, {.mask = {}, .border = 4, .wanted = 80});
  ASSERT_GE(corners.size(), 60U);
  EXPECT_LE(corners.size(), 80U);
  EXPECT_TRUE(std::is_sorted(corners.begin(), corners.end(),
                             [](const auto& a, const auto& b) { return a.response > b.response; }));
  const auto right =
      std::count_if(corners.begin(), corners.end(), [](const Corner& c) { return c.x >= 128; });
  EXPECT_GT(right, 20) << "the stronger half does not take all";
  for (const Corner& c : corners) {
    EXPECT_LE(std::abs((c.x + 8) % 16 - 8), 2) << c.x;
    EXPECT_LE(std::abs((c.y + 8) % 16 - 8), 2) << c.y;
  }
}

TEST(Corners, KeepOffMaskAndBorderAndBelowTheThreshold) {
  const ImageF response = corner_response(squares(128, 96));
  ImageU8 mask(256, 192);  // of level 0; the response is of level 1
  mask.fill(255);
  for (int y = 0; y < 192; ++y) {
    for (int x = 0; x < 128; ++x) mask.at(x, y) = 0;
  }
  const auto corners =
      spread_corners(response, {.mask = mask, .level = 1, .border = 20, .wanted = 200});
  ASSERT_FALSE(corners.empty());
  for (const Corner& c : corners) {
    EXPECT_GE(c.x, 64);
    EXPECT_LT(c.x, 128 - 20);
    EXPECT_GE(c.y, 20);
  }
  EXPECT_TRUE(spread_corners(response, {.mask = {}, .least = 1e6F}).empty());
  EXPECT_TRUE(spread_corners(response, {.mask = {}, .border = 60}).empty()) << "nothing is left";
}

}  // namespace
}  // namespace sovo
