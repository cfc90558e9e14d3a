#include "sovo/vo/keyframe_poses.h"

#include <gtest/gtest.h>

#include <cmath>

namespace sovo {
namespace {

WindowPose at(std::uint32_t id, double x, double y = 0.0) {
  return {id, 100 * (id + 1), SE3(SO3(), Vec3(x, y, 0.0))};
}

TEST(KeyframePoses, AreThoseOfTheWindowAsItIsNow) {
  KeyframePoses poses;
  poses.record({at(0, 3.0)}, 0.0);
  poses.record({at(0, 3.5), at(1, 5.0)}, 0.0);
  ASSERT_EQ(poses.poses().size(), 2U);
  EXPECT_EQ(poses[0].T_world_camera.translation().x(), 3.5);
  EXPECT_EQ(poses[1].id, 1U);
  EXPECT_EQ(poses[1].stamp_ns, 200);
  EXPECT_EQ(poses[0].step.x(), 3.0) << "where the map began stays where it was";
  EXPECT_EQ(poses[1].step.x(), 1.5);
  poses.clear();
  EXPECT_TRUE(poses.poses().empty());
}

TEST(KeyframePoses, StepsAreInTheAxesOfTheKeyframeBefore) {
  KeyframePoses poses;
  WindowPose turned = at(0, 1.0);
  turned.T_world_camera = SE3(SO3::exp(Vec3(0, 0, 0.5 * M_PI)), Vec3(1, 0, 0));
  poses.record({turned, at(1, 1.0, 2.0)}, 0.0);
  EXPECT_LT((poses[1].step - Vec3(2, 0, 0)).norm(), 1e-12);
}

TEST(KeyframePoses, AStepStaysWhenItsFirstEndHasLeft) {
  KeyframePoses poses;
  poses.record({at(0, 0.0), at(1, 1.0), at(2, 2.0)}, 0.0);
  // 1 leaves before 0; what then moves 2 says nothing about its step from 1.
  poses.record({at(0, 0.0), at(2, 2.5), at(3, 3.5)}, 0.0);
  EXPECT_EQ(poses[2].step.x(), 1.0);
  EXPECT_EQ(poses[2].T_world_camera.translation().x(), 2.5);
  EXPECT_EQ(poses[1].T_world_camera.translation().x(), 1.0);
  EXPECT_EQ(poses[3].step.x(), 1.0);
  // Those still together are followed.
  poses.record({at(2, 2.5), at(3, 3.7)}, 0.0);
  EXPECT_NEAR(poses[3].step.x(), 1.2, 1e-12);
}

TEST(KeyframePoses, ANewKeyframeHasAStepEvenFromOneThatLeft) {
  KeyframePoses poses;
  poses.record({at(0, 0.0), at(1, 1.0)}, 0.0);
  poses.record({at(0, 0.0), at(2, 2.0)}, 0.0);
  EXPECT_EQ(poses[2].step.x(), 1.0);
}

TEST(KeyframePoses, LaterSimilaritiesAreUndoneInStepsAndOnlyLaterOnes) {
  KeyframePoses poses;
  poses.record({at(0, 0.0), at(1, 1.0), at(2, 2.0)}, 0.5);
  // Twice as long about keyframe 2, which measured it.
  const double log_scale = 0.5 + std::log(2.0);
  poses.rescale({at(0, -2.0), at(1, 0.0), at(2, 2.0)}, 2.0, log_scale);
  EXPECT_EQ(poses[1].T_world_camera.translation().x(), 0.0);
  EXPECT_EQ(poses[1].later_scale, 2.0);
  EXPECT_EQ(poses[1].step.x(), 1.0) << "as it was: the measurement is not its own";
  EXPECT_EQ(poses[2].later_scale, 1.0);
  EXPECT_EQ(poses[2].step.x(), 2.0) << "rescaled: the measurement is its own";
  EXPECT_EQ(poses[1].log_scale, 0.5);
  EXPECT_EQ(poses[2].log_scale, log_scale);
  // A keyframe that comes afterwards has the sum of all of them.
  poses.record({at(2, 2.0), at(3, 3.0)}, log_scale);
  EXPECT_EQ(poses[3].log_scale, log_scale);
  EXPECT_EQ(poses[3].later_scale, 1.0);
}

TEST(KeyframePoses, WhatHasLeftIsNotTouchedByASimilarity) {
  KeyframePoses poses;
  poses.record({at(0, 0.0), at(1, 1.0), at(2, 2.0)}, 0.0);
  poses.rescale({at(1, 0.0), at(2, 2.0)}, 2.0, std::log(2.0));
  EXPECT_EQ(poses[0].T_world_camera.translation().x(), 0.0);
  EXPECT_EQ(poses[0].later_scale, 1.0);
  EXPECT_EQ(poses[1].step.x(), 1.0);
}

TEST(KeyframePoses, TheFirstScaleOfAMapIsThatOfAllBefore) {
  KeyframePoses poses;
  poses.record({at(0, 1.0), at(1, 2.0), at(2, 3.0)}, 0.0);
  poses.record({at(1, 2.0), at(2, 3.0), at(3, 4.0)}, 0.0);  // 0 has left
  const double log_scale = std::log(3.0);
  poses.rescale_all({at(1, -2.0), at(2, 1.0), at(3, 4.0)}, 3.0, Vec3(4, 0, 0), log_scale);
  for (std::uint32_t id = 0; id < 4; ++id) {
    EXPECT_EQ(poses[id].T_world_camera.translation().x(), 4.0 - 3.0 * (3.0 - id)) << id;
    EXPECT_EQ(poses[id].log_scale, log_scale) << id;
    EXPECT_EQ(poses[id].later_scale, 1.0) << id;
    EXPECT_EQ(poses[id].step.x(), id == 0 ? -5.0 : 3.0) << id;
  }
}

}  // namespace
}  // namespace sovo
