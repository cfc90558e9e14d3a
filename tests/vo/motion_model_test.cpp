#include "sovo/vo/motion_model.h"

#include <gtest/gtest.h>

#include <cmath>

namespace sovo {
namespace {

constexpr std::int64_t kFrame = 50'000'000;

ReferenceKeyframe reference_at(std::uint32_t id, const SE3& T_world_camera) {
  ReferenceKeyframe out;
  out.keyframe_id = id;
  out.stamp_ns = -1;
  out.T_world_camera = T_world_camera;
  out.keyframe_poses = {{id, -1, T_world_camera}};
  return out;
}

/// T_camera_world of a camera that goes on and turns evenly.
SE3 on_its_way(double frames) {
  Vec6 velocity;
  velocity << 0.1, 0.0, 0.4, 0.0, 0.02, 0.01;
  return SE3::exp(frames * velocity);
}

TEST(MotionModel, GoesOnEvenlyOverTheTimeThatPassed) {
  const ReferenceKeyframe reference = reference_at(0, SE3());
  MotionModel model;
  EXPECT_FALSE(model.forecast(reference, 0, 0.0).known) << "nothing was seen";
  model.note(reference, on_its_way(1.0), kFrame);
  // From its keyframe on, for there was nothing before.
  const auto begun = model.forecast(reference, 2 * kFrame, 0.0).known;
  ASSERT_TRUE(begun);
  EXPECT_LT((begun->expected * on_its_way(2.0).inverse()).log().norm(), 1e-7);
  model.note(reference, on_its_way(2.0), 2 * kFrame);
  for (const double frames : {3.0, 5.5}) {  // two and a half are missing in the second
    const auto stamp = static_cast<std::int64_t>(frames * static_cast<double>(kFrame));
    const auto known = model.forecast(reference, stamp, 0.0).known;
    ASSERT_TRUE(known);
    EXPECT_LT((known->expected * on_its_way(frames).inverse()).log().norm(), 1e-9);
    EXPECT_NEAR(known->steps, frames - 2.0, 1e-12);
    EXPECT_TRUE(std::isinf(known->reach));
  }
}

TEST(MotionModel, FollowsItsKeyframesIntoANewReferenceAndANewScale) {
  const ReferenceKeyframe old = reference_at(0, SE3());
  MotionModel model;
  model.note(old, on_its_way(1.0), kFrame);
  model.note(old, on_its_way(2.0), 2 * kFrame);
  // The next keyframe stands a way off, and the map was made twice as large since.
  SE3 T_world_next(SO3::exp(Vec3(0, 0.1, 0)), Vec3(0.2, 0.0, 1.0));
  ReferenceKeyframe next = reference_at(1, T_world_next);
  next.keyframe_poses.push_back({0, -1, SE3()});
  next.log_scale = std::log(2.0);
  const auto known = model.forecast(next, 3 * kFrame, 0.0).known;
  ASSERT_TRUE(known);
  const auto doubled = [](SE3 T) {
    T.translation() *= 2.0;
    return T;
  };
  const SE3 truth = doubled(on_its_way(3.0)) * T_world_next;
  EXPECT_LT((known->expected * truth.inverse()).log().norm(), 1e-9);
  EXPECT_FALSE(model.forecast(reference_at(7, SE3()), 3 * kFrame, 0.0).known)
      << "the keyframe that it hangs on has left the window";
}

TEST(MotionModel, OfKeyframesItTakesTheirPosesInTheWindow) {
  const ReferenceKeyframe old = reference_at(0, SE3());
  MotionModel model;
  const SE3 wrong(SO3(), Vec3(0.0, 0.0, -0.15));
  model.note(old, wrong * on_its_way(1.0), kFrame);
  model.note(old, on_its_way(2.0), 2 * kFrame);
  // Bundle adjustment has found out where the first of both frames was, which became a keyframe.
  ReferenceKeyframe next = reference_at(0, SE3());
  next.keyframe_poses.push_back({1, kFrame, on_its_way(1.0).inverse()});
  const auto known = model.forecast(next, 3 * kFrame, 0.0).known;
  ASSERT_TRUE(known);
  EXPECT_LT((known->expected * on_its_way(3.0).inverse()).log().norm(), 1e-9);
}

TEST(MotionModel, AccelerationLimitsTheReach) {
  const ReferenceKeyframe reference = reference_at(0, SE3());
  MotionModel model;
  model.note(reference, on_its_way(1.0), kFrame);
  model.note(reference, on_its_way(2.0), 2 * kFrame);
  const auto known = model.forecast(reference, 3 * kFrame, 10.0).known;
  ASSERT_TRUE(known);
  EXPECT_NEAR(known->reach, 10.0 * 0.05 * 0.05 + 0.02, 1e-9);
  SE3 beside = known->expected;
  beside.translation().x() += 0.9 * known->reach;
  EXPECT_TRUE(is_reachable(*known, beside));
  beside.translation().x() += 0.3 * known->reach;
  EXPECT_FALSE(is_reachable(*known, beside));
}

TEST(MotionModel, WhatIsSeenFromAMeanDepthAwayIsNotFoundByChance) {
  const SO3 turned = SO3::exp(Vec3(0.5, 0, 0));
  EXPECT_TRUE(is_near(SE3(turned, Vec3(0, 0, 3.9)), 0.25));
  EXPECT_FALSE(is_near(SE3(turned, Vec3(0, 0, 4.1)), 0.25));
  EXPECT_TRUE(is_near(SE3(turned, Vec3(0, 0, 1.9)), 0.25, 0.5));
  EXPECT_FALSE(is_near(SE3(turned, Vec3(0, 0, 2.1)), 0.25, 0.5));
}

TEST(MotionModel, UsualAccelerationsAreATenthOfTheGreatest) {
  const ReferenceKeyframe reference = reference_at(0, SE3());
  MotionModel model;
  model.note(reference, on_its_way(1.0), kFrame);
  model.note(reference, on_its_way(2.0), 2 * kFrame);
  const auto known = model.forecast(reference, 3 * kFrame, 100.0).known;
  ASSERT_TRUE(known);
  // 10 m/s^2 for as long as it takes from the middle of the step before to the new frame.
  EXPECT_NEAR(known->sigma, 10.0 * 0.05 * 0.05, 1e-9);
  const SE3 beside(known->expected.rotation(),
                   known->expected.translation() + Vec3(0.0, 0.03, -0.04));
  EXPECT_NEAR(deviation(*known, beside), 2.0, 1e-9);
  EXPECT_NEAR(deviation(*known, SE3(SO3::exp(Vec3(0.1, 0.2, 0.3)), Vec3::Zero()) * beside), 2.0,
              1e-9)
      << "turns are free";
  const SE3 there = expected_place(*known, SE3(SO3::exp(Vec3(0.1, 0.2, 0.3)), Vec3(5, 6, 7)));
  EXPECT_NEAR(deviation(*known, there), 0.0, 1e-9);
  EXPECT_LT((there.rotation().log() - Vec3(0.1, 0.2, 0.3)).norm(), 1e-12);
  const auto without_metres = model.forecast(reference, 3 * kFrame, 0.0).known;
  ASSERT_TRUE(without_metres);
  EXPECT_EQ(deviation(*without_metres, beside), 0.0);
}

TEST(MotionModel, OfPosesThatFitAlikeTheOneThatNeedsNoAccelerationIsLikelier) {
  const KnownMotion known{
      .expected = SE3(SO3(), Vec3(0, 0, -2.0)), .last = {}, .step = {}, .sigma = 0.1};
  FrameTracking as_expected;
  as_expected.T_current_reference = known.expected;
  as_expected.rmse = 3.3;
  FrameTracking at_rest;
  at_rest.rmse = 3.2;
  // 500 pixels whose noise is as strong as their residuals, and of which four err alike.
  const double information = 500.0 / (4.0 * 3.2 * 3.2);
  EXPECT_LT(improbability(known, as_expected, information),
            improbability(known, at_rest, information));
  // A braking vehicle that the image shows clearly is believed.
  as_expected.rmse = 7.0;
  EXPECT_GT(improbability(known, as_expected, information),
            improbability(known, at_rest, information));
}

}  // namespace
}  // namespace sovo
