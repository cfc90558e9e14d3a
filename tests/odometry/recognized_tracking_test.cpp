#include "sovo/odometry/recognized_tracking.h"

#include <gtest/gtest.h>

#include <cstdint>

#include "sovo/odometry/dead_reckoning.h"
#include "sovo/vo/monocular_backend.h"

namespace sovo {
namespace {

constexpr std::int64_t kStep = 50'000'000;  // [ns]

/// Where a camera was that moves by 0.1 m a frame, until the last of six frames.
DeadReckoning reckoning_of_six() {
  DeadReckoning reckoning;
  for (int i = 0; i < 6; ++i) reckoning.note(i * kStep, SE3(SO3(), Vec3(0.1 * i, 0, 0)), i > 0);
  return reckoning;
}

/// A frame so many steps after that, found so far ahead of the last one.
TrackedFrame frame(int steps, double ahead_m, double rmse, double inlier_ratio = 0.6) {
  TrackedFrame tracked;
  tracked.frame.stamp_ns = (5 + steps) * kStep;
  tracked.tracking.good = true;
  tracked.tracking.rmse = rmse;
  tracked.tracking.inlier_ratio = inlier_ratio;
  tracked.T_world_camera = SE3(SO3(), Vec3(0.5 + ahead_m, 0, 0));
  return tracked;
}

TEST(RecognizedTracking, WhatFitsBadlyAfterAWhileIsDoubtful) {
  const DeadReckoning reckoning = reckoning_of_six();
  EXPECT_TRUE(is_doubtful(frame(6, 0.6, 10.0, 0.74), reckoning));
  EXPECT_FALSE(is_doubtful(frame(6, 0.6, 10.0, 0.76), reckoning)) << "it fits well";
  EXPECT_FALSE(is_doubtful(frame(4, 0.4, 10.0, 0.74), reckoning)) << "there was no time for it";
  EXPECT_FALSE(is_doubtful(frame(6, 0.6, 10.0, 0.74), DeadReckoning())) << "there was none before";
}

TEST(RecognizedTracking, WhatFitsClearlyBetterIsBelieved) {
  const ReckonedPose expected = reckoning_of_six().reckon(15 * kStep);
  const TrackedFrame before = frame(10, 1.1, 10.0);
  EXPECT_TRUE(is_better(frame(10, 0.9, 8.9), before, expected));
  EXPECT_FALSE(is_better(frame(10, 0.9, 9.1), before, expected));
}

TEST(RecognizedTracking, WhatIsLikelyByTheMotionIsBelievedThoughItFitsLess) {
  const ReckonedPose expected = reckoning_of_six().reckon(15 * kStep);
  const TrackedFrame leap = frame(10, 3.0, 10.0);
  ASSERT_FALSE(expected.is_likely(leap.T_world_camera));
  EXPECT_TRUE(is_better(frame(10, 0.9, 12.0), leap, expected));
  EXPECT_FALSE(is_better(frame(10, 2.9, 12.0), leap, expected)) << "neither is likely";
}

TEST(RecognizedTracking, WhatFitsNowhereIsNotReplacedByWhatFitsNotEither) {
  const ReckonedPose expected = reckoning_of_six().reckon(15 * kStep);
  TrackedFrame lost = frame(10, 1.0, 10.0);
  TrackedFrame found = frame(10, 1.0, 5.0);
  lost.tracking.good = false;
  EXPECT_TRUE(is_better(found, lost, expected));
  found.tracking.good = false;
  EXPECT_FALSE(is_better(found, lost, expected));
  EXPECT_FALSE(is_better(found, frame(10, 3.0, 10.0), expected));
}

}  // namespace
}  // namespace sovo
