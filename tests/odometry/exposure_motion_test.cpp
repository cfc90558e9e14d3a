#include "sovo/odometry/exposure_motion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "odometry/odometry_test_support.h"

namespace sovo {
namespace {

using test::drive;
using test::kDriveFrames;
using test::kPeriodNs;
using test::Playback;
using test::staggered_frame;

constexpr std::int64_t kOffsetNs = 20'000'000;

double motion_between(const SE3& a, const SE3& b) { return (a * b.inverse()).log().norm(); }

/// A reference that stands where the drive begins, in a map whose lengths are exp(-log_scale)
/// times the true ones.
ReferenceKeyframe reference_at_start(double log_scale) {
  ReferenceKeyframe reference;
  reference.keyframe_id = 3;
  reference.stamp_ns = -1;
  reference.log_scale = log_scale;
  reference.T_world_camera = drive(0);
  reference.keyframe_poses = {{3, -1, drive(0)}};
  return reference;
}

SE3 in_map(SE3 T, double log_scale) {
  T.translation() *= std::exp(log_scale);
  return T;
}

/// T_later_left of the true drive.
SE3 true_motion(int frame, double frames_later) {
  return drive(frame + frames_later).inverse() * drive(frame);
}

TEST(ExposureMotion, FollowsAWayThatTurnsAndAccelerates) {
  for (const double part : {-0.4, 0.1, 0.4}) {
    ExposureMotion motion;
    for (int i = 0; i < 4; ++i) {
      motion.note(reference_at_start(0.0), drive(i).inverse() * drive(0), i * kPeriodNs);
    }
    const auto offset = static_cast<std::int64_t>(part * static_cast<double>(kPeriodNs));
    // The motion in this time is 14 mm at most.
    EXPECT_LT(motion_between(motion.until(offset), true_motion(3, part)), 3e-5) << part;
  }
}

TEST(ExposureMotion, IsThatOfTheMapAfterASimilarity) {
  ExposureMotion motion;
  for (int i = 0; i < 4; ++i) {
    const double log_scale = i < 3 ? 0.0 : 0.7;
    motion.note(reference_at_start(log_scale), in_map(drive(i).inverse() * drive(0), log_scale),
                i * kPeriodNs);
  }
  const SE3 expected = in_map(true_motion(3, 0.4), 0.7);
  EXPECT_LT(motion_between(motion.until(kOffsetNs), expected), 2e-4);
}

TEST(ExposureMotion, IsNoneWhileNothingIsKnown) {
  ExposureMotion motion;
  EXPECT_EQ(motion.until(kOffsetNs).log().norm(), 0.0);
  motion.note(reference_at_start(0.0), SE3(), 0);
  EXPECT_EQ(motion.until(kOffsetNs).log().norm(), 0.0);
  motion.note(reference_at_start(0.0), drive(1).inverse() * drive(0), kPeriodNs);
  EXPECT_GT(motion.until(kOffsetNs).log().norm(), 0.005);
  EXPECT_EQ(motion.until(0).log().norm(), 0.0);
}

struct Kind {
  const char* name;
  OdometryMode mode;
  Backend backend;
  double tolerance;  ///< Corners take longer to forget how the map began.
};

class StaggeredExposures : public testing::TestWithParam<Kind> {
 protected:
  static StereoOdometryConfig config() {
    StereoOdometryConfig config = test::test_config();
    config.mode = GetParam().mode;
    config.backend = GetParam().backend;
    return config;
  }
  /// How much of the way was found. The map begins without a known motion, so the first ten frames
  /// count for nothing.
  static double scale_of(const StereoOdometryConfig& config, std::int64_t offset_ns) {
    Playback playback(config);
    for (int i = 0; i < kDriveFrames; ++i) playback.give(staggered_frame(i, offset_ns));
    auto poses = test::published(playback.recorder);
    EXPECT_EQ(poses.size(), static_cast<std::size_t>(kDriveFrames));
    poses.erase(poses.begin(), poses.begin() + 10);
    return test::drive_error(poses).scale;
  }
};

TEST_P(StaggeredExposures, GiveTheTrueScale) {
  for (const std::int64_t offset : {kOffsetNs, -kOffsetNs}) {
    // Where a map begins wrongly, single seeds scatter by half a percent.
    double mean = 0.0;
    for (const int seed : {0, 1, 2}) {
      StereoOdometryConfig seeded = config();
      seeded.seed = seed;
      mean += scale_of(seeded, offset) / 3.0;
    }
    EXPECT_NEAR(mean, 1.0, GetParam().tolerance) << offset;
    StereoOdometryConfig ignorant = config();
    ignorant.exposure_motion = false;
    EXPECT_GT(std::abs(scale_of(ignorant, offset) - 1.0), 0.05) << offset;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Modes, StaggeredExposures,
    testing::Values(Kind{"Scale", OdometryMode::kScale, Backend::kDirect, 0.01},
                    Kind{"Stereo", OdometryMode::kStereo, Backend::kDirect, 0.01},
                    Kind{"Features", OdometryMode::kScale, Backend::kFeatures, 0.04}),
    [](const testing::TestParamInfo<Kind>& kind) { return kind.param.name; });

/// All published poses of a drive whose stamps err by so much.
std::vector<TrajectoryPose> poses_with(bool exposure_motion, double stamp_sigma_s) {
  StereoOdometryConfig config = test::test_config();
  config.exposure_motion = exposure_motion;
  Playback playback(config);
  for (int i = 0; i < 12; ++i) {
    StereoFrame frame = staggered_frame(i, kOffsetNs);
    frame.stamp_sigma_s = stamp_sigma_s;
    playback.give(frame);
  }
  return test::published(playback.recorder);
}

bool same_bits(const std::vector<TrajectoryPose>& a, const std::vector<TrajectoryPose>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) {
    return x.T_odom_left.matrix() == y.T_odom_left.matrix();
  });
}

TEST(ExposureMotion, WhatStampsErrByIsNoOffset) {
  const auto ignorant = poses_with(false, 0.0);
  EXPECT_TRUE(same_bits(poses_with(true, 0.01), ignorant)) << "three sigmas of two stamps: 42 ms";
  EXPECT_FALSE(same_bits(poses_with(true, 0.001), ignorant));
}

TEST(ExposureMotion, KeyframesTellIt) {
  // The second one is the first that tells, while the map still gets its scale: single seeds
  // scatter.
  double second = 0.0;
  int later = 0;
  for (const int seed : {0, 1, 2}) {
    StereoOdometryConfig config = test::test_config();
    config.seed = seed;
    Playback playback(config);
    for (int i = 0; i < kDriveFrames; ++i) playback.give(staggered_frame(i, kOffsetNs));
    for (const KeyframeOutput& k : playback.recorder.keyframes) {
      if (k.revised || k.id < 2) continue;
      const int frame = test::index_of(k.stamp_ns);
      const double error = motion_between(k.T_later_left, true_motion(frame, 0.4));
      if (k.id == 2) {
        second += error / 3.0;
        continue;
      }
      EXPECT_LT(error, 5e-4) << k.id << " of seed " << seed;
      ++later;
    }
  }
  EXPECT_GT(second, 0.0);
  EXPECT_LT(second, 2e-3);
  EXPECT_GT(later, 6);
}

}  // namespace
}  // namespace sovo
