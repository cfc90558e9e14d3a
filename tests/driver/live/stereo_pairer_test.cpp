#include "sovo/driver/live/stereo_pairer.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace sovo {
namespace {

constexpr std::int64_t kPeriod = 33'333'333;

TimedImage image(std::int64_t time_ns, std::uint64_t sequence = 0) {
  TimedImage result;
  result.time_ns = time_ns;
  result.sequence = sequence;
  return result;
}

std::vector<StereoPair> drain(StereoPairer* pairer) {
  std::vector<StereoPair> pairs;
  while (auto pair = pairer->next()) pairs.push_back(std::move(*pair));
  return pairs;
}

TEST(StereoPairer, ArrivalDoesNotMatter) {
  StereoPairer pairer(kPeriod / 4);
  for (int n = 0; n < 3; ++n) pairer.add(CameraSide::kRight, image(n * kPeriod + 1000));
  EXPECT_TRUE(drain(&pairer).empty());
  for (int n = 0; n < 3; ++n) pairer.add(CameraSide::kLeft, image(n * kPeriod));
  const auto pairs = drain(&pairer);
  ASSERT_EQ(pairs.size(), 3U);
  for (const auto& pair : pairs) {
    ASSERT_TRUE(pair.right);
    EXPECT_EQ(pair.right->time_ns - pair.left.time_ns, 1000);
  }
}

TEST(StereoPairer, ALostImageNeverPairsItsNeighbour) {
  StereoPairer pairer(kPeriod / 4);
  std::vector<StereoPair> pairs;
  for (int n = 0; n < 10; ++n) {
    if (n != 4) pairer.add(CameraSide::kLeft, image(n * kPeriod));
    if (n != 7) pairer.add(CameraSide::kRight, image(n * kPeriod - 500));
    for (auto& pair : drain(&pairer)) pairs.push_back(std::move(pair));
  }
  ASSERT_EQ(pairs.size(), 9U);
  int alone = 0;
  for (const auto& pair : pairs) {
    if (!pair.right) ++alone;
    if (pair.right) {
      EXPECT_EQ(pair.right->time_ns, pair.left.time_ns - 500);
    }
  }
  EXPECT_EQ(alone, 1);
  EXPECT_EQ(pairer.counts().pairs, 8U);
  EXPECT_EQ(pairer.counts().unpaired_left, 1U);
  EXPECT_EQ(pairer.counts().unpaired_right, 1U);
}

TEST(StereoPairer, OfTwoWithinTheToleranceTheNearerIsTaken) {
  for (const std::int64_t nearer : {-2000, 2000}) {
    StereoPairer pairer(kPeriod / 4);
    pairer.add(CameraSide::kRight, image(-5000));
    pairer.add(CameraSide::kRight, image(nearer));
    pairer.add(CameraSide::kLeft, image(0));
    const auto pairs = drain(&pairer);
    ASSERT_EQ(pairs.size(), 1U);
    ASSERT_TRUE(pairs[0].right);
    EXPECT_EQ(pairs[0].right->time_ns, nearer);
    EXPECT_EQ(pairer.counts().unpaired_right, 1U);
  }
}

TEST(StereoPairer, OneSideGoesOnWithoutTheOther) {
  StereoPairer pairer(kPeriod / 4, 3);
  std::size_t given = 0;
  for (int n = 0; n < 20; ++n) {
    pairer.add(CameraSide::kLeft, image(n * kPeriod));
    for (const auto& pair : drain(&pairer)) {
      EXPECT_FALSE(pair.right);
      ++given;
    }
  }
  EXPECT_EQ(given, 17U);
  StereoPairer other(kPeriod / 4, 3);
  for (int n = 0; n < 20; ++n) other.add(CameraSide::kRight, image(n * kPeriod));
  EXPECT_TRUE(drain(&other).empty());
  EXPECT_EQ(other.counts().unpaired_right, 17U);
}

TEST(StereoPairer, OutOfOrderIsDroppedAndARestartForgives) {
  StereoPairer pairer(kPeriod / 4);
  pairer.add(CameraSide::kLeft, image(5 * kPeriod));
  pairer.add(CameraSide::kLeft, image(4 * kPeriod));
  EXPECT_EQ(pairer.counts().out_of_order, 1U);
  pairer.restart();
  pairer.add(CameraSide::kLeft, image(kPeriod));
  pairer.add(CameraSide::kRight, image(kPeriod));
  EXPECT_EQ(drain(&pairer).size(), 1U);
  EXPECT_EQ(pairer.counts().unpaired_left, 1U);
}

TEST(StereoPairer, RandomLossesJitterAndArrivals) {
  std::mt19937_64 random(3);
  for (int run = 0; run < 50; ++run) {
    StereoPairer pairer(kPeriod / 4);
    std::vector<TimedImage> sides[2];
    for (std::uint64_t n = 0; n < 200; ++n) {
      for (auto& side : sides) {
        if (random() % 10 == 0) continue;
        const auto jitter = static_cast<std::int64_t>(random() % 4'000'000);
        side.push_back(image(static_cast<std::int64_t>(n) * kPeriod + jitter, n));
      }
    }
    std::uint64_t given = 0;
    std::int64_t last = -1;
    std::size_t at[2] = {0, 0};
    while (at[0] < sides[0].size() || at[1] < sides[1].size()) {
      const std::size_t s = random() % 2;
      // No camera is more than two images behind the other.
      const std::uint64_t end = 1000;
      const auto due = [&](std::size_t i) {
        return at[i] == sides[i].size() ? end : sides[i][at[i]].sequence;
      };
      if (due(s) == end || due(s) > due(1 - s) + 2) continue;
      pairer.add(s == 0 ? CameraSide::kLeft : CameraSide::kRight, sides[s][at[s]++]);
      while (const auto pair = pairer.next()) {
        ++given;
        EXPECT_GT(pair->left.time_ns, last);
        last = pair->left.time_ns;
        if (pair->right) {
          EXPECT_EQ(pair->right->sequence, pair->left.sequence);
        }
      }
    }
    pairer.restart();
    const PairerCounts& counts = pairer.counts();
    EXPECT_EQ(counts.pairs + counts.unpaired_left, at[0]);
    EXPECT_EQ(counts.pairs + counts.unpaired_right, at[1]);
    EXPECT_GT(counts.pairs, 100U);
    EXPECT_LE(given, at[0]);
  }
}

}  // namespace
}  // namespace sovo
