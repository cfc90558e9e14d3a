#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "odometry/odometry_test_support.h"

namespace sovo {
namespace {

using namespace test;

constexpr int kFrames = 40;

/// A window so small that keyframes leave it early.
StereoOdometryConfig small_window() {
  StereoOdometryConfig config = test_config();
  config.vo.keyframe.max_keyframes = 4;
  config.vo.keyframe.min_keyframes = 3;
  return config;
}

std::vector<KeyframeOutput> of_segment(const Recorder& recorder, std::uint32_t segment,
                                       bool revised) {
  std::vector<KeyframeOutput> out;
  for (const KeyframeOutput& k : recorder.keyframes) {
    if (k.segment == segment && k.revised == revised) out.push_back(k);
  }
  return out;
}

/// What a subscriber keeps that lets a message replace an earlier one of the same keyframe.
std::map<std::uint32_t, KeyframeOutput> kept(const Recorder& recorder, std::uint32_t segment) {
  std::map<std::uint32_t, KeyframeOutput> out;
  for (const KeyframeOutput& k : recorder.keyframes) {
    if (k.segment == segment) out[k.id] = k;
  }
  return out;
}

SE3 pose_at(const std::vector<TrajectoryPose>& trajectory, std::int64_t stamp_ns) {
  for (const TrajectoryPose& p : trajectory) {
    if (p.stamp_ns == stamp_ns) return p.T_odom_left;
  }
  ADD_FAILURE() << "no pose at " << stamp_ns;
  return {};
}

double distance(const SE3& a, const SE3& b) { return (a.inverse() * b).log().norm(); }

/// Median of ln(true depth / depth) of a keyframe's points, in the true world.
double log_depth_error(const KeyframeOutput& k, const CameraModel& camera) {
  static const SyntheticScene scene(3);
  const SE3 truth = drive(index_of(k.stamp_ns));
  std::vector<double> errors;
  for (std::size_t i = 0; i < k.u.size(); ++i) {
    errors.push_back(std::log(scene.depth(camera, truth, Vec2(k.u[i], k.v[i])) *
                              static_cast<double>(k.inverse_depth[i])));
  }
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  return *middle;
}

void expect_first_ones_ascend(const Recorder& recorder, std::uint32_t segment) {
  std::uint32_t next = 0;
  for (const KeyframeOutput& k : recorder.keyframes) {
    if (k.segment != segment) continue;
    if (k.revised) {
      EXPECT_LT(k.id, next) << "revised before it was given out";
    } else {
      EXPECT_EQ(k.id, next++);
    }
  }
}

TEST(KeyframeOutput, ComesAgainWithItsRefinedPoseWhenItLeavesTheWindow) {
  Playback run(small_window());
  run.give_drive(0, kFrames);
  expect_first_ones_ascend(run.recorder, 0);
  const auto first = of_segment(run.recorder, 0, false);
  const auto left = of_segment(run.recorder, 0, true);
  ASSERT_GE(left.size(), 4U);
  EXPECT_EQ(first.size() - left.size(), run.recorder.frames.back().keyframes);
  const auto trajectory = run.odometry.refined_trajectory();
  for (const KeyframeOutput& k : left) {
    EXPECT_LT(distance(k.T_odom_left, pose_at(trajectory, k.stamp_ns)), 1e-4) << k.id;
  }

  run.odometry.finish();
  const auto last = kept(run.recorder, 0);
  ASSERT_EQ(last.size(), first.size());
  EXPECT_EQ(of_segment(run.recorder, 0, true).size(), first.size()) << "each once";
  for (const auto& [id, k] : last) {
    EXPECT_TRUE(k.revised) << id;
    EXPECT_TRUE(k.scale_valid) << id;
    EXPECT_EQ(k.stamp_ns, first[id].stamp_ns);
    EXPECT_LT(distance(k.T_odom_left, pose_at(trajectory, k.stamp_ns)), 1e-4) << id;
  }
}

TEST(KeyframeOutput, RevisedOnesHoldTheirOwnPointsAtTheirTrueDepths) {
  Playback run(small_window());
  run.give_drive(0, kFrames);
  run.odometry.finish();
  const auto first = of_segment(run.recorder, 0, false);
  std::size_t revised_points = 0;
  int compared = 0;
  for (const KeyframeOutput& k : of_segment(run.recorder, 0, true)) {
    ASSERT_EQ(k.u.size(), k.v.size());
    ASSERT_EQ(k.u.size(), k.inverse_depth.size());
    ASSERT_EQ(k.u.size(), k.sigma.size());
    ASSERT_EQ(k.u.size(), k.intensity.size());
    revised_points += k.u.size();
    if (k.u.size() < 30) continue;
    ++compared;
    EXPECT_NE(k.u, first[k.id].u) << k.id;
    EXPECT_NEAR(log_depth_error(k, run.odometry.tracked_camera()), 0.0, 0.03) << k.id;
    for (std::size_t i = 0; i < k.u.size(); ++i) {
      ASSERT_EQ(k.u[i], std::round(k.u[i])) << "the pixel that was selected";
      ASSERT_GT(k.sigma[i], 0.0F);
      ASSERT_LE(k.sigma[i], 0.5F * k.inverse_depth[i] * 1.0001F);
    }
  }
  EXPECT_GE(compared, 4);
  // More than the window ever held: those that left it are kept.
  EXPECT_GT(revised_points, run.recorder.frames.back().points);
}

TEST(KeyframeOutput, DepthsHaveTheScaleOfThePose) {
  // The first right image comes from a rig with a shorter baseline: the map begins 7 % too long,
  // and the corrections that follow are undone in the keyframes before them.
  StereoOdometryConfig config = small_window();
  config.vo.window.free_static_weight = 0.0;  // with such residuals the window mends itself
  Playback run(config);
  run.give(first_frame_of_narrow_rig(0.93));
  run.give_drive(1, kFrames);
  run.odometry.finish();
  const double total = run.recorder.frames.back().log_scale;
  EXPECT_NEAR(total, std::log(0.93), 0.03);
  const auto last = kept(run.recorder, 0);
  EXPECT_EQ(last.at(0).log_scale, 0.0);
  int compared = 0;
  for (const auto& [id, k] : last) {
    if (k.u.size() < 30) continue;
    EXPECT_NEAR(log_depth_error(k, run.odometry.tracked_camera()), total - k.log_scale, 0.03) << id;
    ++compared;
  }
  EXPECT_GE(compared, 4);
}

TEST(KeyframeOutput, ThoseThatLeaveWithoutAScaleWaitForIt) {
  StereoOdometryConfig config = small_window();
  config.init = InitMethod::kTwoView;
  Playback run(config);
  int i = 0;
  const auto keyframes = [&] { return of_segment(run.recorder, 0, false).size(); };
  for (; i < 2 * kFrames && keyframes() < 7; ++i) {
    StereoFrame frame = drive_frame(i);
    frame.right.valid = false;
    run.give(frame);
  }
  ASSERT_GE(keyframes(), 7U);
  EXPECT_TRUE(of_segment(run.recorder, 0, true).empty());
  for (const KeyframeOutput& k : run.recorder.keyframes) EXPECT_FALSE(k.scale_valid) << k.id;
  for (const int end = i + 2 * kFrames; i < end && of_segment(run.recorder, 0, true).size() < 4;
       ++i) {
    run.give(drive_frame(i));
  }
  ASSERT_TRUE(run.recorder.frames.back().scale_valid);
  run.odometry.finish();
  expect_first_ones_ascend(run.recorder, 0);
  const auto trajectory = run.odometry.refined_trajectory();
  int compared = 0;
  for (const KeyframeOutput& k : of_segment(run.recorder, 0, true)) {
    EXPECT_TRUE(k.scale_valid) << k.id;
    if (k.id > 0) {  // the first one was passed before the map began
      EXPECT_LT(distance(k.T_odom_left, pose_at(trajectory, k.stamp_ns)), 1e-3) << k.id;
    }
    if (k.u.size() < 5) continue;
    EXPECT_NEAR(log_depth_error(k, run.odometry.tracked_camera()), 0.0, 0.05) << k.id;
    ++compared;
  }
  EXPECT_GE(compared, 4);
}

TEST(KeyframeOutput, ASegmentThatEndsGivesOutItsWindow) {
  for (const bool deterministic : {true, false}) {
    StereoOdometryConfig config = small_window();
    config.deterministic = deterministic;
    config.wait_for_mapping = true;
    Playback run(config);
    run.give_drive(0, 10);
    run.odometry.reset();
    EXPECT_EQ(kept(run.recorder, 0).size(), of_segment(run.recorder, 0, true).size());
    run.give_drive(10, 20);
    run.odometry.finish();
    for (const std::uint32_t segment : {0U, 1U}) {
      expect_first_ones_ascend(run.recorder, segment);
      const auto last = kept(run.recorder, segment);
      EXPECT_GE(last.size(), 2U);
      for (const auto& [id, k] : last) EXPECT_TRUE(k.revised) << segment << ", " << id;
    }
    std::uint32_t segment = 0;
    for (const KeyframeOutput& k : run.recorder.keyframes) {
      EXPECT_GE(k.segment, segment) << "the old segment speaks no more";
      segment = k.segment;
    }
  }
}

TEST(KeyframeOutput, ModeMonoRevisesWithoutClaimingScale) {
  StereoOdometryConfig config = small_window();
  config.mode = OdometryMode::kMono;
  Playback run(config);
  run.give_drive(0, 20);
  EXPECT_FALSE(of_segment(run.recorder, 0, true).empty());
  run.odometry.finish();
  for (const KeyframeOutput& k : run.recorder.keyframes) EXPECT_FALSE(k.scale_valid) << k.id;
}

TEST(KeyframeOutput, IsTheSameToTheLastBitWithOneThreadOrTwo) {
  std::vector<std::vector<KeyframeOutput>> results;
  for (const int threads : {1, 2}) {
    StereoOdometryConfig config = small_window();
    config.threads = threads;
    Playback run(config);
    run.give_drive(0, 20);
    run.odometry.finish();
    results.push_back(run.recorder.keyframes);
  }
  ASSERT_EQ(results[0].size(), results[1].size());
  for (std::size_t i = 0; i < results[0].size(); ++i) {
    const KeyframeOutput& a = results[0][i];
    const KeyframeOutput& b = results[1][i];
    EXPECT_EQ(a.id, b.id);
    EXPECT_EQ(a.revised, b.revised);
    EXPECT_EQ(a.T_odom_left.matrix(), b.T_odom_left.matrix()) << i;
    EXPECT_EQ(a.u, b.u) << i;
    EXPECT_EQ(a.inverse_depth, b.inverse_depth) << i;
    EXPECT_EQ(a.sigma, b.sigma) << i;
    EXPECT_EQ(a.intensity, b.intensity) << i;
  }
}

}  // namespace
}  // namespace sovo
