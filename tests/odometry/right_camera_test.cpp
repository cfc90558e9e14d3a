#include "sovo/odometry/right_camera.h"

#include <gtest/gtest.h>

#include "odometry/odometry_test_support.h"

namespace sovo {
namespace {

const Vec3 kSlope(0.1, -40.0, 2.0);  // d log-scale / d turn

ScaleEstimate estimate_with(const Vec3& turn) {
  ScaleEstimate estimate;
  estimate.log_scale = 0.01;
  estimate.sigma = 0.001;
  estimate.verdict = ScaleVerdict::kAccepted;
  estimate.turn = {true, turn, Vec3::Constant(1e-4), kSlope};
  return estimate;
}

/// A camera that is turned by `turn`, as `count` keyframes show it; what came of the last one.
struct Noted {
  double change = 0.0;
  ScaleEstimate estimate;
};
Noted note(const Vec3& turn, int count, RightCamera* camera) {
  Noted out;
  for (int i = 0; i < count; ++i) {
    const SO3 given = camera->turn();
    out.estimate = estimate_with((SO3::exp(turn) * given.inverse()).log());
    out.change = camera->note(given, &out.estimate);
  }
  return out;
}

class RightCameraTest : public testing::Test {
 protected:
  const StereoRig rig_ = test::test_cameras().rig;
  RightCamera camera_{{}, rig_, RightTurn({}, rig_.right.fx)};
};

TEST_F(RightCameraTest, IsAsItWasCalibratedUntilKeyframesAgree) {
  const Noted noted = note({0, 0.01, 0}, 4, &camera_);
  EXPECT_EQ(noted.change, 0.0);
  EXPECT_EQ(noted.estimate.log_scale, 0.01);
  EXPECT_EQ(noted.estimate.sigma, 0.001);
  EXPECT_EQ(noted.estimate.verdict, ScaleVerdict::kAccepted);
  EXPECT_FALSE(camera_.known().decalibrated());
}

TEST_F(RightCameraTest, WhatWasMeasuredBecomesThatOfTheNewTurn) {
  const Vec3 turn(0, 0.006, 0);  // 1.2 px
  note(turn, 4, &camera_);
  const Noted noted = note(turn, 1, &camera_);
  EXPECT_TRUE(camera_.known().decalibrated());
  EXPECT_NEAR(noted.change, -0.24, 1e-6);
  EXPECT_NEAR(noted.estimate.log_scale, 0.01 - 0.24, 1e-6);
  EXPECT_NEAR(noted.estimate.sigma, 0.072, 0.001);
  EXPECT_EQ(noted.estimate.verdict, ScaleVerdict::kAccepted);
  const SE3 expected = rig_.turned(SO3::exp(turn)).T_right_left;
  EXPECT_LT((camera_.rig().T_right_left * expected.inverse()).log().norm(), 1e-9);
  EXPECT_NEAR(note(turn, 1, &camera_).estimate.log_scale, 0.01, 1e-6);
}

TEST_F(RightCameraTest, AScaleOfQuiteAnotherTurnIsNone) {
  const Vec3 turn(0.02, 0, 0);  // 4 px
  note(turn, 4, &camera_);
  EXPECT_EQ(note(turn, 1, &camera_).estimate.verdict, ScaleVerdict::kUnobservable);
  EXPECT_EQ(note(turn, 1, &camera_).estimate.verdict, ScaleVerdict::kAccepted);
}

TEST_F(RightCameraTest, AnAmbiguousScaleOfAnotherTurnIsNone) {
  const Vec3 turn(0, 0.006, 0);
  note(turn, 4, &camera_);
  ScaleEstimate ambiguous = estimate_with(turn);
  ambiguous.verdict = ScaleVerdict::kAmbiguous;
  camera_.note(SO3(), &ambiguous);
  EXPECT_EQ(ambiguous.verdict, ScaleVerdict::kUnobservable);
}

TEST_F(RightCameraTest, AScaleIsBroughtToTheTurnOfNow) {
  note({0, 0.01, 0}, 10, &camera_);
  // The job began when a little less was undone.
  const SO3 given = SO3::exp({0, 0.009, 0});
  ScaleEstimate late = estimate_with((camera_.turn() * given.inverse()).log());
  EXPECT_NEAR(camera_.note(given, &late), 0.0, 1e-9);
  EXPECT_EQ(late.verdict, ScaleVerdict::kAccepted);
  EXPECT_NEAR(late.log_scale, 0.01 - 0.04, 1e-6);
}

TEST_F(RightCameraTest, NoScaleIsTakenWhileTheTurnIsInDoubt) {
  note(Vec3::Zero(), 20, &camera_);
  EXPECT_EQ(note({0, 0.01, 0}, 1, &camera_).estimate.verdict, ScaleVerdict::kUnobservable);
  EXPECT_EQ(note(Vec3::Zero(), 1, &camera_).estimate.verdict, ScaleVerdict::kAccepted);
  EXPECT_EQ(note({0, 0.006, 0}, 5, &camera_).estimate.verdict, ScaleVerdict::kUnobservable);
  EXPECT_EQ(note({0, 0.006, 0}, 1, &camera_).estimate.verdict, ScaleVerdict::kAccepted);
}

}  // namespace
}  // namespace sovo
