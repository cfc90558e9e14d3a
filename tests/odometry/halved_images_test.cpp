#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "odometry/odometry_test_support.h"
#include "sovo/odometry/frame_preparation.h"

namespace sovo {
namespace {

using namespace test;

constexpr double kBlurredError = 0.04;  // of a way of 1.3 m, seen in 120x90 blurred pixels

StereoFrame blurred_frame(int i) {
  constexpr int kRadius = 4;
  StereoFrame frame = drive_frame(i);
  frame.left = blurred(frame.left, kRadius);
  frame.right = blurred(frame.right, kRadius);
  return frame;
}

double median_log_depth_error(const KeyframeOutput& k, const CameraModel& camera) {
  static const SyntheticScene scene(3);
  std::vector<double> errors;
  for (std::size_t i = 0; i < k.u.size(); ++i) {
    const double depth = scene.depth(camera, drive(index_of(k.stamp_ns)), Vec2(k.u[i], k.v[i]));
    errors.push_back(std::abs(std::log(depth * static_cast<double>(k.inverse_depth[i]))));
  }
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  return *middle;
}

TEST(HalvedImages, AreThePyramidsLevelsOfTheWholeOnes) {
  FramePreparation preparation(test_config(), test_cameras());
  ASSERT_EQ(preparation.max_halvings(), 1) << "a quarter of 240x180 is too small";
  const StereoFrame frame = drive_frame(0);
  const MonoFrame whole = preparation.prepare_left(frame, nullptr, 0);
  const MonoFrame half = preparation.prepare_left(frame, nullptr, 1);
  ImagePyramid right, right_half;
  preparation.prepare_right(frame.right, 0, whole, &right);
  preparation.prepare_right(frame.right, 1, whole, &right_half);
  const auto same = [](const ImageF& a, const ImageF& b) {
    return a.width() == b.width() && a.height() == b.height() &&
           std::equal(a.data(), a.data() + a.size(), b.data());
  };
  EXPECT_TRUE(same(whole.pyramid->level(1), half.pyramid->level(0)));
  EXPECT_TRUE(same(right.level(1), right_half.level(0)));
  EXPECT_EQ(half.pyramid->level(0).width(), preparation.rig(1).left.width);
  EXPECT_EQ(right_half.level(0).height(), preparation.rig(1).right.height);
  // The whole images again, in memory that was halved ones'.
  preparation.prepare_right(frame.right, 0, whole, &right_half);
  EXPECT_EQ(right_half.num_levels(), right.num_levels());
  EXPECT_TRUE(same(right_half.level(0), right.level(0)));
  const ImageF copy = whole.pyramid->level(0);
  EXPECT_TRUE(same(copy, preparation.prepare_left(frame, nullptr, 0).pyramid->level(0)));
}

TEST(HalvedImages, CarryAMapWhereWholeOnesAreTooBlurred) {
  Playback run(test_config());
  int first = -1;
  for (int i = 0; i < 40; ++i) {
    const OdometryOutput out = run.give(blurred_frame(i));
    if (!out.pose_valid) continue;
    EXPECT_EQ(out.halvings, 1) << i;
    if (first < 0) {
      first = i;
      EXPECT_NE(out.reason.find("reduced to 1/2"), std::string::npos) << out.reason;
      EXPECT_NE(out.reason.find("static stereo matches"), std::string::npos) << out.reason;
    } else {
      EXPECT_EQ(out.reason, "") << i;
    }
  }
  run.odometry.finish();
  ASSERT_EQ(first, 5) << "whole images get their chance first";
  const auto poses = published(run.recorder);
  ASSERT_EQ(poses.size(), 35U);
  const DriveError error = drive_error(poses);
  EXPECT_LT(error.rms, kBlurredError);
  EXPECT_NEAR(error.scale, 1.0, 0.03);
}

TEST(HalvedImages, GiveOutTheirPointsInTheWholeImage) {
  Playback run(test_config());
  for (int i = 0; i < 20; ++i) run.give(blurred_frame(i));
  run.odometry.finish();
  ASSERT_FALSE(run.recorder.keyframes.empty());
  const CameraModel& camera = run.odometry.tracked_camera();
  float farthest = 0.0F;
  int compared = 0;
  for (const KeyframeOutput& k : run.recorder.keyframes) {
    if (k.u.size() < 50) continue;
    ++compared;
    EXPECT_LT(median_log_depth_error(k, camera), 0.05) << k.id;
    farthest = std::max(farthest, *std::max_element(k.u.begin(), k.u.end()));
    if (k.revised) continue;
    EXPECT_EQ(k.halvings, 1);
    EXPECT_EQ(k.left->level(0).width(), camera.width / 2);
  }
  EXPECT_GE(compared, 4);
  EXPECT_GT(farthest, 0.7F * static_cast<float>(camera.width));
}

TEST(HalvedImages, AreNotTakenWhereTheConfigurationForbidsThem) {
  StereoOdometryConfig config = test_config();
  config.max_halvings = 0;
  Playback run(config);
  for (int i = 0; i < 20; ++i) {
    EXPECT_FALSE(run.give(blurred_frame(i)).pose_valid) << i;
  }
}

TEST(HalvedImages, AClearImageIsTrackedWholeAgainAfterAReset) {
  Playback run(test_config());
  for (int i = 0; i < 10; ++i) run.give(blurred_frame(i));
  ASSERT_EQ(run.recorder.frames.back().halvings, 1);
  run.odometry.reset();
  const OdometryOutput out = run.give(drive_frame(10));
  EXPECT_TRUE(out.pose_valid);
  EXPECT_EQ(out.halvings, 0);
  EXPECT_EQ(out.segment, 1U);
}

TEST(HalvedImages, WhereTheyAreNeededTheNextMapNeedNotWaitForThem) {
  constexpr int kElsewhere = 200;
  Playback run(test_config());
  for (int i = 0; i < 20; ++i) run.give(blurred_frame(i));
  ASSERT_EQ(run.recorder.frames.back().halvings, 1);
  int lost = 0;
  for (; lost < 10 && run.recorder.frames.back().segment == 0; ++lost) {
    EXPECT_EQ(run.give(blurred_frame(kElsewhere + lost)).state, OdometryState::kLost);
  }
  const OdometryOutput out = run.give(blurred_frame(kElsewhere + lost));
  EXPECT_TRUE(out.pose_valid) << out.reason;
  EXPECT_EQ(out.segment, 1U);
  EXPECT_EQ(out.halvings, 1);
}

TEST(HalvedImages, LiveThreadsTakeThemToo) {
  StereoOdometryConfig config = test_config();
  config.deterministic = false;
  config.wait_for_mapping = true;
  Playback run(config);
  for (int i = 0; i < 30; ++i) run.give(blurred_frame(i));
  run.odometry.finish();
  EXPECT_EQ(published(run.recorder).size(), 25U);
  EXPECT_LT(drive_error(published(run.recorder)).rms, kBlurredError);
}

}  // namespace
}  // namespace sovo
