#include "sovo/vo/point_activation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace sovo {
namespace {

TEST(OccupancyMap, FindsTakenPixelsAsSearchingAllOfThemDoes) {
  constexpr int kWidth = 141;
  constexpr int kHeight = 67;
  std::mt19937 random(2);
  OccupancyMap map(kWidth, kHeight);
  std::vector<std::pair<int, int>> taken;
  const auto pixel = [&] {
    return std::pair(static_cast<int>(random() % kWidth), static_cast<int>(random() % kHeight));
  };
  int near = 0;
  int far = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    if (trial % 50 == 0) {
      taken.push_back(pixel());
      map.take(taken.back().first, taken.back().second);
    }
    const auto [x, y] = pixel();
    const float distance = 0.1F * static_cast<float>(random() % 170);
    const bool expected = std::any_of(taken.begin(), taken.end(), [&](const auto& other) {
      const int dx = std::abs(x - other.first);
      const int dy = std::abs(y - other.second);
      return static_cast<float>(std::max(dx, dy)) + 0.5F * static_cast<float>(std::min(dx, dy)) <
             distance;
    });
    EXPECT_EQ(map.any_closer(x, y, distance), expected) << x << " " << y << " " << distance;
    ++(expected ? near : far);
  }
  EXPECT_GT(near, 300);
  EXPECT_GT(far, 300);
}

}  // namespace
}  // namespace sovo
