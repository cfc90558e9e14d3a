#include "sovo/eval/live_drift.h"

#include <gtest/gtest.h>

namespace sovo {
namespace {

Trajectory drive() {
  Trajectory truth;
  for (int i = 0; i < 50; ++i) {
    truth.push_back(
        {i * 100'000'000LL, SE3(SO3::exp({0, 0.01 * i, 0}), Vec3(0.3 * i, 0, 0.4 * i))});
  }
  return truth;
}

TEST(LiveDrift, OfTheTruthItselfIsZeroInAnyWorld) {
  LiveDrift meter(drive());
  const SE3 T_odom_world(SO3::exp({0.3, -1.0, 2.0}), Vec3(5, -6, 7));
  for (int i = 3; i < 50; ++i) {
    const StampedPose& pose = meter.truth()[static_cast<std::size_t>(i)];
    const auto value = meter.update(pose.stamp_ns, 0, T_odom_world * pose.T_world_body);
    ASSERT_TRUE(value);
    EXPECT_LT(value->drift_m, 1e-9);
    EXPECT_NEAR(value->path_m, 0.5 * (i - 3), 1e-9);
  }
}

TEST(LiveDrift, OfAScaleErrorIsItsShareOfTheWay) {
  LiveDrift meter(drive());
  const Trajectory& truth = meter.truth();
  std::optional<LiveDrift::Value> value;
  for (const StampedPose& pose : truth) {
    const SE3 scaled(pose.T_world_body.rotation(), 1.02 * pose.T_world_body.translation());
    value = meter.update(pose.stamp_ns, 0, scaled);
  }
  ASSERT_TRUE(value);
  EXPECT_NEAR(value->drift_m, 0.02 * value->path_m, 1e-9);
}

TEST(LiveDrift, ANewSegmentBeginsAnewAndUnknownStampsHaveNone) {
  LiveDrift meter(drive());
  const Trajectory truth = meter.truth();
  ASSERT_TRUE(meter.update(truth[0].stamp_ns, 0, truth[0].T_world_body));
  const SE3 lost(SO3(), Vec3(100, 0, 0));
  EXPECT_GT(meter.update(truth[9].stamp_ns, 0, lost)->drift_m, 50.0);
  const auto again = meter.update(truth[10].stamp_ns, 1, lost);
  EXPECT_LT(again->drift_m, 1e-9);
  EXPECT_EQ(again->path_m, 0.0);
  EXPECT_FALSE(meter.update(truth[49].stamp_ns + 60'000'000, 1, lost));
  EXPECT_TRUE(meter.update(truth[49].stamp_ns + 40'000'000, 1, lost));
  EXPECT_FALSE(LiveDrift({}).update(0, 0, lost));
}

}  // namespace
}  // namespace sovo
