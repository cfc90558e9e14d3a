#include "sovo/app/profile_collector.h"

#include <gtest/gtest.h>

namespace sovo::app {
namespace {

TEST(DurationSamples, QuantilesOfFewSamplesAreExact) {
  DurationSamples samples;
  for (int i = 100; i >= 0; --i) samples.add(0.01 * i);
  EXPECT_EQ(samples.count(), 101U);
  EXPECT_NEAR(samples.mean(), 0.5, 1e-12);
  EXPECT_NEAR(samples.quantile(0.5), 0.5, 1e-6);
  EXPECT_NEAR(samples.quantile(0.95), 0.95, 1e-6);
  EXPECT_EQ(samples.max(), 1.0);
  EXPECT_EQ(samples.last(), 0.0);
}

TEST(DurationSamples, ManySamplesKeepTheirDistribution) {
  DurationSamples samples;
  constexpr int kCount = 1000000;
  for (int i = 0; i < kCount; ++i) samples.add(static_cast<double>(i % 1009));
  EXPECT_EQ(samples.count(), static_cast<std::uint64_t>(kCount));
  EXPECT_NEAR(samples.quantile(0.5), 504.0, 10.0);
  EXPECT_NEAR(samples.quantile(0.95), 957.0, 10.0);
  EXPECT_EQ(samples.max(), 1008.0);
}

TEST(DurationSamples, NothingIsZero) {
  const DurationSamples samples;
  EXPECT_EQ(samples.quantile(0.5), 0.0);
  EXPECT_EQ(samples.mean(), 0.0);
}

TEST(ProfileCollector, ListsEveryStageAndAveragesTheWindows) {
  ProfileCollector profile;
  profile.on_stage(Stage::kTracking, 0.002);
  profile.on_stage(Stage::kTracking, 0.004);
  profile.on_window(1000, 5000);
  profile.on_window(2000, 6000);
  const auto stages = profile.stages();
  ASSERT_EQ(stages.size(), static_cast<std::size_t>(Stage::kCount));
  const StageSummary& tracking = stages[static_cast<std::size_t>(Stage::kTracking)];
  EXPECT_EQ(tracking.name, "tracking");
  EXPECT_EQ(tracking.count, 2U);
  EXPECT_NEAR(tracking.mean_ms, 3.0, 1e-9);
  EXPECT_NEAR(tracking.last_ms, 4.0, 1e-9);
  EXPECT_EQ(stages[0].count, 0U);
  EXPECT_EQ(profile.counters().points, 1500.0);
  EXPECT_EQ(profile.counters().residuals, 5500.0);
}

}  // namespace
}  // namespace sovo::app
