#include "sovo/eval/association.h"

#include <gtest/gtest.h>

namespace sovo {
namespace {

constexpr std::int64_t kMs = 1'000'000;

std::vector<std::int64_t> every(std::int64_t period, int count, std::int64_t start = 0) {
  std::vector<std::int64_t> stamps;
  for (int i = 0; i < count; ++i) stamps.push_back(start + i * period);
  return stamps;
}

TEST(Association, PicksTheNearestWithinTolerance) {
  const auto truth = every(5 * kMs, 200);
  const std::vector<std::int64_t> estimate{2 * kMs, 53 * kMs, 1200 * kMs};
  const auto pairs = associate(truth, estimate, 2 * kMs);
  ASSERT_EQ(pairs.size(), 2U);
  EXPECT_EQ(pairs[0].truth, 0U);
  EXPECT_EQ(pairs[1].truth, 11U);
  EXPECT_EQ(pairs[1].estimate, 1U);
}

TEST(Association, ToleranceIsInclusive) {
  const std::vector<std::int64_t> truth{0, 100};
  const std::vector<std::int64_t> estimate{40};
  EXPECT_EQ(associate(truth, estimate, 40).size(), 1U);
  EXPECT_EQ(associate(truth, estimate, 39).size(), 0U);
}

TEST(Association, OneTruthServesTheNearerOfTwo) {
  const std::vector<std::int64_t> truth{100};
  const std::vector<std::int64_t> estimate{80, 105, 130};
  const auto pairs = associate(truth, estimate, 50);
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_EQ(pairs[0].estimate, 1U);
}

TEST(Association, DefaultToleranceIsHalfTheShorterPeriodAtMostTwentyMilliseconds) {
  EXPECT_EQ(default_tolerance(every(5 * kMs, 10), every(50 * kMs, 10)), 5 * kMs / 2);
  EXPECT_EQ(default_tolerance(every(100 * kMs, 10), every(100 * kMs, 10)), 20 * kMs);
  EXPECT_EQ(default_tolerance({}, {}), 20 * kMs);
}

TEST(Association, EmptySidesGiveNothing) {
  EXPECT_TRUE(associate({}, every(10, 3), 5).empty());
  EXPECT_TRUE(associate(every(10, 3), {}, 5).empty());
}

}  // namespace
}  // namespace sovo
