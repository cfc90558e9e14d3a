#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "odometry/odometry_test_support.h"
#include "sovo/odometry/readout_motion.h"

namespace sovo {
namespace {

using test::drive;
using test::kPeriodNs;
using test::Playback;

constexpr int kRolledFrames = 24;
constexpr double kReadoutMs = 20.0;  // of a period of 50

/// The drive at twice its speed, swaying: at 0.6 rad/s, back and forth in fifteen frames.
SE3 swaying(double i) {
  const Vec3 sway(0.07 * std::sin(0.42 * i), 0.07 * std::sin(0.33 * i), 0.05 * std::sin(0.5 * i));
  return drive(2.0 * i) * SE3(SO3::exp(sway), Vec3::Zero());
}

/// What a rolling shutter shows of it; the last row `readout_ms` after the first one.
SideImage rolled_side(const test::SyntheticScene& scene, const CameraModel& camera,
                      const SE3& T_left_camera, int i, double readout_ms) {
  ImageF image(camera.width, camera.height);
  for (int y = 0; y < camera.height; ++y) {
    const double share = static_cast<double>(y) / (camera.height - 1) - 0.5;
    const double frames_later = 1e6 * readout_ms * share / static_cast<double>(kPeriodNs);
    const SE3 T_world_camera = swaying(i + frames_later) * T_left_camera;
    for (int x = 0; x < camera.width; ++x) {
      const Vec3 ray = T_world_camera.rotation() * *camera.unproject({x, y});
      image.at(x, y) = static_cast<float>(scene.cast(T_world_camera.translation(), ray).value);
    }
  }
  return test::side_of(image);
}

/// Frame `i`; rendered once a program.
StereoFrame rolled_frame(int i, double readout_ms) {
  static const test::SyntheticScene scene(3);
  static std::map<std::pair<int, double>, StereoFrame> rendered;
  const auto found = rendered.find({i, readout_ms});
  if (found != rendered.end()) return found->second;
  const StereoCameras cameras = test::test_cameras();
  StereoFrame frame = test::drive_frame(i);
  frame.left = rolled_side(scene, cameras.rig.left, SE3(), i, readout_ms);
  frame.right =
      rolled_side(scene, cameras.rig.right, cameras.rig.T_right_left.inverse(), i, readout_ms);
  rendered[{i, readout_ms}] = frame;
  return frame;
}

double error_of(const std::vector<TrajectoryPose>& poses) {
  double sum = 0.0;
  for (const TrajectoryPose& p : poses) {
    const Vec3 truth = swaying(test::index_of(p.stamp_ns)).translation();
    sum += (p.T_odom_left.translation() - truth).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(poses.size()));
}

struct RolledKind {
  const char* name;
  OdometryMode mode;
  Backend backend;
  double readout_ms;
  double share_left;  ///< Of the error without correction.
};

class RollingShutter : public testing::TestWithParam<RolledKind> {
 protected:
  static StereoOdometryConfig config(double readout_ms) {
    StereoOdometryConfig config = test::test_config();
    config.mode = GetParam().mode;
    config.backend = GetParam().backend;
    config.readout_ms = readout_ms;
    return config;
  }
  /// Rms error of position [m]; the first pose is the origin in both.
  static double error_with(const StereoOdometryConfig& config) {
    Playback playback(config);
    for (int i = 0; i < kRolledFrames; ++i) playback.give(rolled_frame(i, GetParam().readout_ms));
    const auto poses = test::published(playback.recorder);
    EXPECT_EQ(poses.size(), static_cast<std::size_t>(kRolledFrames));
    return error_of(poses);
  }
};

TEST_P(RollingShutter, IsUndone) {
  const double corrected = error_with(config(GetParam().readout_ms));
  const double ignorant = error_with(config(0.0));
  EXPECT_LT(corrected, GetParam().share_left * ignorant)
      << "corrected " << corrected << " m, not corrected " << ignorant << " m";
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, RollingShutter,
    testing::Values(
        RolledKind{"Scale", OdometryMode::kScale, Backend::kDirect, kReadoutMs, 0.15},
        RolledKind{"Stereo", OdometryMode::kStereo, Backend::kDirect, kReadoutMs, 0.25},
        RolledKind{"FromBelow", OdometryMode::kScale, Backend::kDirect, -kReadoutMs, 0.15},
        RolledKind{"Features", OdometryMode::kScale, Backend::kFeatures, kReadoutMs, 0.2}),
    [](const testing::TestParamInfo<RolledKind>& kind) { return kind.param.name; });

TEST(RollingShutterMap, BeginsOnceMoreWithTheSecondFrame) {
  StereoOdometryConfig config = test::test_config();
  config.readout_ms = kReadoutMs;
  Playback playback(config);
  for (int i = 0; i < 8; ++i) {
    const OdometryOutput out = playback.give(rolled_frame(i, kReadoutMs));
    EXPECT_TRUE(out.pose_valid) << i;
    EXPECT_EQ(out.segment, 0U) << i;
  }
  playback.odometry.finish();
  std::multiset<std::uint32_t> fresh;
  for (const KeyframeOutput& k : playback.recorder.keyframes) {
    if (!k.revised) fresh.insert(k.id);
  }
  EXPECT_EQ(fresh.count(0), 1U) << "the first keyframe is given out as new once";
  EXPECT_EQ(playback.odometry.refined_trajectory().size(), 8U);
}

TEST(RollingShutterMap, AKnockedFrameWaitsToBecomeAKeyframe) {
  const test::SyntheticScene scene(3);
  const StereoCameras cameras = test::test_cameras();
  constexpr int kKnocked = 8;
  StereoFrame knocked = test::drive_frame(kKnocked);
  // Turned by five degrees on a sudden: any frame like that wants to be a keyframe.
  const SE3 pose = test::drive(kKnocked) * SE3(SO3::exp(Vec3(0.0, 0.09, 0.0)), Vec3::Zero());
  knocked.left = test::side_of(scene.render(cameras.rig.left, pose));
  knocked.right =
      test::side_of(scene.render(cameras.rig.right, pose * cameras.rig.T_right_left.inverse()));
  for (const double readout_ms : {0.0, 1.0, 10.0}) {
    StereoOdometryConfig config = test::test_config();
    config.readout_ms = readout_ms;
    Playback playback(config);
    playback.give_drive(0, kKnocked);
    const OdometryOutput out = playback.give(knocked);
    EXPECT_TRUE(out.pose_valid) << readout_ms;
    EXPECT_EQ(out.is_keyframe, readout_ms < 5.0) << readout_ms;
  }
}

TEST(RollingShutterMap, EqualRunsAreEqual) {
  StereoOdometryConfig config = test::test_config();
  config.readout_ms = kReadoutMs;
  std::vector<std::vector<TrajectoryPose>> runs;
  for (const int threads : {1, 2}) {
    config.threads = threads;
    Playback playback(config);
    for (int i = 0; i < 12; ++i) playback.give(rolled_frame(i, kReadoutMs));
    runs.push_back(test::published(playback.recorder));
  }
  ASSERT_EQ(runs[0].size(), runs[1].size());
  for (std::size_t i = 0; i < runs[0].size(); ++i) {
    EXPECT_EQ(runs[0][i].T_odom_left.matrix(), runs[1][i].T_odom_left.matrix()) << i;
  }
}

TEST(RollingShutterMap, LiveThreadsFollowToo) {
  StereoOdometryConfig config = test::test_config();
  config.deterministic = false;
  config.wait_for_mapping = true;
  config.readout_ms = kReadoutMs;
  Playback playback(config);
  for (int i = 0; i < 20; ++i) playback.give(rolled_frame(i, kReadoutMs));
  playback.odometry.finish();
  const auto poses = test::published(playback.recorder);
  ASSERT_EQ(poses.size(), 20U);
  EXPECT_LT(error_of(poses), 0.01);
}

/// The frame that was tracked last, of a camera that moves straight on.
class ReadoutMotionTest : public testing::Test {
 protected:
  ReadoutMotionTest() {
    config_.readout_ms = 16.0;
    preparation_.emplace(config_, test::test_cameras());
    motion_.emplace(*preparation_);
    reference_ = std::make_shared<ReferenceKeyframe>();
    reference_->stamp_ns = 0;
    reference_->keyframe_poses = {{0, reference_->stamp_ns, SE3()}};
    motion_->begin(*reference_);
    for (int i = 1; i < 4; ++i) motion_->note(tracked(i));
  }

  TrackedFrame tracked(int i) const {
    TrackedFrame out;
    out.frame.stamp_ns = i * kPeriodNs;
    out.frame.rate = rate_;
    out.reference = reference_;
    out.tracking.good = true;
    out.tracking.T_current_reference = SE3::exp(0.05 * i * rate_);
    return out;
  }
  const Vec6 rate_ = (Vec6() << 0.1, 0.0, -0.5, 0.2, -0.1, 0.05).finished();
  StereoOdometryConfig config_;
  std::optional<FramePreparation> preparation_;
  std::optional<ReadoutMotion> motion_;
  std::shared_ptr<ReferenceKeyframe> reference_;
};

TEST_F(ReadoutMotionTest, IsAsTheFramesBeforeTell) {
  EXPECT_LT((motion_->expected(4 * kPeriodNs) - rate_).norm(), 1e-6);
  EXPECT_LT((motion_->found() - rate_).norm(), 1e-6);
  EXPECT_FALSE(motion_->differs(rate_, tracked(3)));
}

TEST_F(ReadoutMotionTest, AKnockIsAnotherTurningThanExpected) {
  Vec6 expected = rate_;
  expected[0] += 5.0;
  expected[3] += 0.2;
  EXPECT_TRUE(motion_->is_steady(expected)) << "a third of a pixel";
  expected[3] += 2.0;
  EXPECT_FALSE(motion_->is_steady(expected));
}

TEST_F(ReadoutMotionTest, AFrameTrackedAgainTakesThePlaceOfItself) {
  motion_->note(tracked(3));
  motion_->note(tracked(3));
  EXPECT_LT((motion_->found() - rate_).norm(), 1e-6);
}

TEST_F(ReadoutMotionTest, WithoutARollingShutterThereIsNone) {
  config_.readout_ms = 0.0;
  const FramePreparation at_once(config_, test::test_cameras());
  ReadoutMotion motion(at_once);
  motion.begin(*reference_);
  for (int i = 1; i < 4; ++i) motion.note(tracked(i));
  EXPECT_EQ(motion.expected(4 * kPeriodNs).norm(), 0.0);
  EXPECT_FALSE(motion.differs(10.0 * rate_, tracked(3)));
}

}  // namespace
}  // namespace sovo
