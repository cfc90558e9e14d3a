#include <string>

#include "odometry/odometry_test_support.h"

namespace sovo::test {

namespace {

/// The motion from one pose of the drive to another, as it was found, is off by this [m].
double step_error(const OdometryOutput& from, const OdometryOutput& to) {
  const SE3 found = from.T_odom_left.inverse() * to.T_odom_left;
  const SE3 truth = drive(index_of(from.stamp_ns)).inverse() * drive(index_of(to.stamp_ns));
  return (found.translation() - truth.translation()).norm();
}

/// What another scene looks like, at the instant of a frame of the drive.
StereoFrame elsewhere(int i) {
  const SyntheticScene scene(11);
  const StereoCameras cameras = test_cameras();
  StereoFrame frame = drive_frame(i);
  const SE3 pose(SO3(), Vec3(1e-3 * i, 0, 0));
  frame.left = side_of(scene.render(cameras.rig.left, pose));
  frame.right = side_of(scene.render(cameras.rig.right, pose * cameras.rig.T_right_left.inverse()));
  return frame;
}

/// Where the camera of `turned_frame` is.
SE3 turned(int i, double yaw) { return drive(i) * SE3(SO3::exp(Vec3(0, yaw, 0)), Vec3::Zero()); }

/// Frame `i` of the drive, of a camera that has turned by `yaw` [rad] meanwhile.
StereoFrame turned_frame(int i, double yaw) {
  const SyntheticScene scene(3);
  const StereoCameras cameras = test_cameras();
  const SE3 pose = turned(i, yaw);
  StereoFrame frame = drive_frame(i);
  frame.left = side_of(scene.render(cameras.rig.left, pose));
  frame.right = side_of(scene.render(cameras.rig.right, pose * cameras.rig.T_right_left.inverse()));
  return frame;
}

}  // namespace

TEST(LostTrack, WhatWasSeenLastTellsWhereACameraIsThatTurnedMeanwhile) {
  constexpr double kYaw = 0.35;
  for (const bool deterministic : {true, false}) {
    StereoOdometryConfig config = test_config();
    config.deterministic = deterministic;
    config.wait_for_mapping = true;
    Playback run(config);
    run.give_drive(0, 8);
    const OdometryOutput found = run.give(turned_frame(16, kYaw));
    EXPECT_TRUE(found.pose_valid) << found.reason;
    EXPECT_EQ(found.segment, 0U);
    EXPECT_EQ(found.reason, "found by what the last keyframes saw");
    const SE3 error = found.T_odom_left.inverse() * drive(0).inverse() * turned(16, kYaw);
    EXPECT_LT(error.translation().norm(), 0.02);
    EXPECT_LT(error.rotation().log().norm(), 0.01);
  }
}

TEST(LostTrack, WithoutRecognitionSuchATurnIsLost) {
  StereoOdometryConfig config = test_config();
  config.recognition.enable = false;
  Playback run(config);
  run.give_drive(0, 8);
  EXPECT_EQ(run.give(turned_frame(16, 0.35)).state, OdometryState::kLost);
}

TEST(LostTrack, WhatTooFewLandmarksAgreeOnIsNotBelieved) {
  StereoOdometryConfig config = test_config();
  config.recognition.min_support = 1.01;
  Playback run(config);
  run.give_drive(0, 8);
  EXPECT_EQ(run.give(turned_frame(16, 0.35)).state, OdometryState::kLost);
}

TEST(LostTrack, WhereNoMotionIsKnownMoreLandmarksMustAgree) {
  for (const int lost_inliers : {25, 1000}) {
    StereoOdometryConfig config = test_config();
    config.recognition.lost_inliers = lost_inliers;
    Playback run(config);
    run.give_drive(0, 1);
    const OdometryOutput out = run.give(turned_frame(8, 0.35));
    EXPECT_EQ(out.state == OdometryState::kLost, lost_inliers > 25) << out.reason;
  }
}

TEST(LostTrack, NobodyIsWhereNoMotionLeads) {
  Playback run(test_config());
  run.give_drive(0, 8);
  StereoFrame frame = turned_frame(16, 0.35);
  frame.stamp_ns = drive_frame(8).stamp_ns;  // 0.26 m in one frame, after 0.03 m in each before
  EXPECT_EQ(run.give(frame).state, OdometryState::kLost);
}

TEST(LostTrack, ANewSegmentBeginsWhereItIsRecognized) {
  constexpr double kYaw = 0.35;
  for (const bool enable : {true, false}) {
    StereoOdometryConfig config = test_config();
    config.recognition.enable = enable;
    config.lost_frames = 3;
    Playback run(config);
    run.give_drive(0, 6);
    for (int i = 6; i < 9; ++i) run.give(unrelated_frame(i));
    const OdometryOutput again = run.give(turned_frame(16, kYaw));
    EXPECT_TRUE(again.pose_valid) << again.reason;
    EXPECT_EQ(again.segment, 1U);
    const SE3 error = again.T_odom_left.inverse() * drive(0).inverse() * turned(16, kYaw);
    EXPECT_EQ(error.translation().norm() < 0.02 && error.rotation().log().norm() < 0.01, enable)
        << error.translation().norm() << " m, " << error.rotation().log().norm();
  }
}

TEST(LostTrack, AfterALossANewSegmentBeginsWhereTheMotionLed) {
  for (const bool deterministic : {true, false}) {
    StereoOdometryConfig config = test_config();
    config.deterministic = deterministic;
    config.wait_for_mapping = true;
    config.lost_frames = 3;
    Playback run(config);
    run.give_drive(0, 6);
    const OdometryOutput last = run.recorder.frames.back();
    for (int i = 6; i < 9; ++i) {
      const OdometryOutput o = run.give(unrelated_frame(i));
      EXPECT_EQ(o.state, OdometryState::kLost);
      EXPECT_FALSE(o.pose_valid);
      EXPECT_NE(o.reason, "");
      EXPECT_EQ(o.segment, i < 8 ? 0U : 1U);
    }
    EXPECT_NE(run.recorder.frames.back().reason.find("new segment"), std::string::npos);
    const OdometryOutput again = run.give(drive_frame(9));
    EXPECT_TRUE(again.pose_valid) << again.reason;
    EXPECT_EQ(again.segment, 1U);
    EXPECT_LT(step_error(last, again), 0.01) << "of 0.12 m";
    run.give_drive(10, 16);
    EXPECT_EQ(run.recorder.frames.back().state, OdometryState::kTracking);
    run.odometry.finish();
    const auto refined = run.odometry.refined_trajectory();
    ASSERT_EQ(refined.size(), 13U);
    EXPECT_NEAR(drive_error({refined.begin() + 6, refined.end()}).scale, 1.0, 0.05);
  }
}

TEST(LostTrack, AMapThatTheNextFrameDoesNotFitBeginsAnewWithThat) {
  Playback run(test_config());
  EXPECT_TRUE(run.give(elsewhere(0)).pose_valid);
  const OdometryOutput lost = run.give(drive_frame(1));
  EXPECT_EQ(lost.state, OdometryState::kLost);
  EXPECT_FALSE(lost.pose_valid);
  EXPECT_EQ(lost.segment, 1U);
  EXPECT_NE(lost.reason.find("new segment"), std::string::npos) << lost.reason;
  for (int i = 2; i < 7; ++i) {
    const OdometryOutput out = run.give(drive_frame(i));
    EXPECT_EQ(out.state, OdometryState::kTracking) << i << ": " << out.reason;
    EXPECT_EQ(out.segment, 1U);
    const Vec3 way = (drive(1).inverse() * drive(i)).translation();
    EXPECT_LT((out.T_odom_left.translation() - way).norm(), 0.01);
  }
}

TEST(LostTrack, WhoHasMovedFarWaitsForTwoLostFramesOnly) {
  for (const double speed : {1.0, 6.0}) {
    Playback run(test_config());
    for (int i = 0; i < 5; ++i) {
      StereoFrame frame = drive_frame(static_cast<int>(speed * i));
      frame.stamp_ns = drive_frame(i).stamp_ns;
      EXPECT_TRUE(run.give(frame).pose_valid);
    }
    EXPECT_EQ(run.give(elsewhere(14)).segment, 0U) << "a frame may be bad";
    const OdometryOutput lost = run.give(elsewhere(15));
    EXPECT_EQ(lost.state, OdometryState::kLost);
    EXPECT_EQ(lost.segment, speed > 1.0 ? 1U : 0U) << lost.reason;
  }
}

TEST(LostTrack, ACoveredCameraThatIsUncoveredBeginsFromStereoWithoutMotion) {
  Playback run(test_config());
  const auto dark = [](int x, int y) { return 4 + (7 * x + 13 * y) % 3; };
  for (int i = 0; i < 7; ++i) {
    EXPECT_EQ(run.give(with_left(drive_frame(i), dark)).state, OdometryState::kInitializing);
  }
  OdometryOutput last;
  for (int i = 7; i < 13; ++i) {
    last = run.give(with_noise(drive_frame(7), i));
  }
  EXPECT_EQ(last.state, OdometryState::kTracking) << last.reason;
  EXPECT_TRUE(last.pose_valid);
  EXPECT_TRUE(last.scale_valid);
}

TEST(LostTrack, OneUnrelatedFrameLosesNoMap) {
  Playback run(test_config());
  run.give_drive(0, 6);
  EXPECT_EQ(run.give(unrelated_frame(6)).state, OdometryState::kLost);
  run.give_drive(7, 12);
  EXPECT_EQ(run.recorder.frames.back().segment, 0U);
  expect_follows_the_drive(published(run.recorder), 0.015, 0.05);
}

TEST(LostTrack, ResetBeginsAnew) {
  for (const bool deterministic : {true, false}) {
    StereoOdometryConfig config = test_config();
    config.deterministic = deterministic;
    Playback run(config);
    run.give_drive(0, 8);
    run.odometry.reset();
    run.give_drive(8, 14);
    const OdometryOutput& last = run.recorder.frames.back();
    EXPECT_EQ(last.reset_counter, 1U);
    EXPECT_EQ(last.segment, 1U);
    EXPECT_TRUE(last.pose_valid);
    run.odometry.finish();
    const auto refined = run.odometry.refined_trajectory();
    EXPECT_EQ(refined.size(), 14U);
    EXPECT_LT(step_error(run.recorder.frames[7], run.recorder.frames[8]), 0.005) << "of 0.03 m";
  }
}

}  // namespace sovo::test
