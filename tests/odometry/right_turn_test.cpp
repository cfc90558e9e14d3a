#include "sovo/scale/right_turn.h"

#include <gtest/gtest.h>

#include "odometry/odometry_test_support.h"

namespace sovo {
namespace {

using test::Playback;
using test::published;

constexpr int kLongDrive = 30;  ///< Frames, a dozen keyframes.
constexpr int kShortDrive = 20;
const Vec3 kTurn(0.006, -0.009, 0.012);  // 1.2, 1.8 and 2.4 px

/// Cameras whose images are those of the drive when the right one is turned by `turn`.
StereoCameras decalibrated_cameras(const Vec3& turn = kTurn) {
  StereoCameras cameras = test::test_cameras();
  cameras.rig = cameras.rig.turned(SO3::exp(turn).inverse());
  return cameras;
}

StereoOdometryConfig config_of_many_keyframes() {
  StereoOdometryConfig config = test::test_config();
  config.vo.keyframe.flow_translation = 0.15;
  return config;
}

/// Static depths hide a yaw, and hold the map in mode `stereo` and by features: there it takes
/// longer than this drive.
struct TurnKind {
  const char* name;
  OdometryMode mode;
  Backend backend;
  Vec3 turn;
  double tolerance;  ///< Of the scale of the second half.
};

class RightTurnOfADrive : public testing::TestWithParam<TurnKind> {
 protected:
  static StereoOdometryConfig config(bool undo) {
    StereoOdometryConfig config = config_of_many_keyframes();
    config.mode = GetParam().mode;
    config.backend = GetParam().backend;
    config.right_turn.undo = undo;
    return config;
  }
  /// Of the second half of the way, ideal is 1.
  static double scale_of(const Playback& playback) {
    auto poses = published(playback.recorder);
    poses.erase(poses.begin(), poses.begin() + static_cast<std::ptrdiff_t>(poses.size() / 2));
    return test::drive_error(poses).scale;
  }
};

TEST_P(RightTurnOfADrive, IsFoundAndUndone) {
  const Vec3 turn = GetParam().turn;
  Playback playback(config(true), decalibrated_cameras(turn));
  playback.give_drive(0, kLongDrive);
  EXPECT_LT((playback.odometry.right_turn().log() - turn).norm(), 0.0015);
  const OdometryOutput& last = playback.recorder.frames.back();
  EXPECT_TRUE(last.decalibrated);
  EXPECT_LT((last.right_turn - turn).norm(), 0.002);
  EXPECT_NE(last.reason.find("turned against its calibration"), std::string::npos) << last.reason;
  EXPECT_EQ(last.state, OdometryState::kTracking);

  Playback ignorant(config(false), decalibrated_cameras(turn));
  ignorant.give_drive(0, kLongDrive);
  EXPECT_FALSE(ignorant.recorder.frames.back().decalibrated);
  const double error = std::abs(scale_of(playback) - 1.0);
  EXPECT_LT(error, GetParam().tolerance);
  if (turn.y() != 0.0) {
    EXPECT_GT(std::abs(scale_of(ignorant) - 1.0), 0.1);
  }

  Playback calibrated(config(true));
  calibrated.give_drive(0, kLongDrive);
  for (const OdometryOutput& o : calibrated.recorder.frames) {
    EXPECT_FALSE(o.decalibrated);
    EXPECT_TRUE(o.right_turn.isZero(0.0));
  }
  EXPECT_TRUE(calibrated.odometry.right_turn().log().isZero(0.0));
}

INSTANTIATE_TEST_SUITE_P(
    Modes, RightTurnOfADrive,
    testing::Values(
        TurnKind{"Scale", OdometryMode::kScale, Backend::kDirect, kTurn, 0.01},
        TurnKind{"Stereo", OdometryMode::kStereo, Backend::kDirect, {0.006, 0, 0.012}, 0.06},
        TurnKind{"Features", OdometryMode::kScale, Backend::kFeatures, {0.006, 0, 0.012}, 0.02}),
    [](const testing::TestParamInfo<TurnKind>& kind) { return kind.param.name; });

/// Pitch, and roll that takes all but the middle of the images away from the epipolar curves: what
/// is matched beside them, or compared there, says less about the scale.
TEST(RightTurn, StaticMatchesAndResidualsFollowIt) {
  StereoOdometryConfig config = config_of_many_keyframes();
  config.mode = OdometryMode::kStereo;
  Playback turned(config, decalibrated_cameras({0.004, 0, 0.025}));
  turned.give_drive(0, kLongDrive);
  Playback calibrated(config);
  calibrated.give_drive(0, kLongDrive);
  EXPECT_LT(turned.recorder.frames.back().log_scale_sigma,
            1.2 * calibrated.recorder.frames.back().log_scale_sigma);
}

TEST(RightTurn, IsKnownToTheNextSegment) {
  Playback playback(config_of_many_keyframes(), decalibrated_cameras());
  playback.give_drive(0, 20);
  ASSERT_TRUE(playback.recorder.frames.back().decalibrated);
  playback.odometry.reset();
  const OdometryOutput first = playback.give(test::drive_frame(20));
  EXPECT_TRUE(first.pose_valid) << first.reason;
  EXPECT_TRUE(first.decalibrated);
  playback.give_drive(21, kLongDrive);
  std::vector<TrajectoryPose> poses;
  for (const OdometryOutput& o : playback.recorder.frames) {
    if (o.segment == first.segment) poses.push_back({o.stamp_ns, o.T_odom_left});
  }
  EXPECT_NEAR(test::drive_error(poses).scale, 1.0, 0.01);
}

TEST(RightTurn, KeyframesHaveItInTheMotionBetweenTheirImages) {
  Playback playback(config_of_many_keyframes(), decalibrated_cameras());
  playback.give_drive(0, kShortDrive);
  const SE3 T_right_left = decalibrated_cameras().rig.T_right_left;
  const KeyframeOutput* newest = nullptr;
  for (const KeyframeOutput& k : playback.recorder.keyframes) {
    if (!k.revised) newest = &k;
  }
  ASSERT_NE(newest, nullptr);
  const SE3 seen = T_right_left * newest->T_later_left;
  const SE3 real = test::test_cameras().rig.T_right_left;
  EXPECT_LT((seen * real.inverse()).log().tail<3>().norm(), 0.0015);
  EXPECT_LT((seen.inverse().translation() - real.inverse().translation()).norm(), 1e-9);
}

TEST(RightTurn, IsTheSameInEqualRunsAndFoundByLiveThreads) {
  const auto found = [](const StereoOdometryConfig& config) {
    Playback playback(config, decalibrated_cameras());
    playback.give_drive(0, kLongDrive);
    playback.odometry.finish();
    return playback.odometry.right_turn().log();
  };
  StereoOdometryConfig config = config_of_many_keyframes();
  EXPECT_EQ(found(config), found(config));
  config.deterministic = false;
  config.wait_for_mapping = true;
  EXPECT_LT((found(config) - kTurn).norm(), 0.002);
}

}  // namespace
}  // namespace sovo
