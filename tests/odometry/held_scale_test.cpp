#include "sovo/odometry/held_scale.h"

#include <gtest/gtest.h>

#include <cmath>

#include "odometry/odometry_test_support.h"

namespace sovo {
namespace {

ScaleEstimate none(ScaleVerdict verdict) {
  ScaleEstimate estimate;
  estimate.verdict = verdict;
  return estimate;
}

TEST(HeldScale, StandsInForAScaleThatCouldNotBeSeen) {
  const ScaleOptimizerConfig config;
  const HeldScale known{std::pow(0.5 * config.max_sigma_tracking, 2)};
  for (const ScaleVerdict blind : {ScaleVerdict::kTooFewPoints, ScaleVerdict::kUnobservable}) {
    EXPECT_TRUE(known.stands_in_for(none(blind), config));
    EXPECT_FALSE(HeldScale().stands_in_for(none(blind), config)) << "no static residuals";
    const HeldScale vague{std::pow(2.0 * config.max_sigma_tracking, 2)};
    EXPECT_FALSE(vague.stands_in_for(none(blind), config));
  }
  for (const ScaleVerdict other :
       {ScaleVerdict::kAccepted, ScaleVerdict::kInnovation, ScaleVerdict::kTooFewInliers,
        ScaleVerdict::kAmbiguous, ScaleVerdict::kNoRightImage}) {
    EXPECT_FALSE(known.stands_in_for(none(other), config));
  }
  ScaleEstimate elsewhere = none(ScaleVerdict::kTooFewPoints);
  elsewhere.out_of_view = true;
  EXPECT_FALSE(known.stands_in_for(elsewhere, config)) << "this scale may be what is wrong";
}

TEST(HeldScale, IsKnownNoBetterThanImagesLieWhereTheyShould) {
  const ScaleOptimizerConfig config;
  BundleResult far;
  far.scale_variance = 1e-8;
  far.scale_per_px = 0.2;  // disparities of five pixels
  EXPECT_NEAR(std::sqrt(held_scale(far, config).variance), 0.01, 1e-4);
  BundleResult near = far;
  near.scale_per_px = 0.01;
  EXPECT_LT(std::sqrt(held_scale(near, config).variance), 1e-3);
  EXPECT_GT(held_scale(near, config).variance, near.scale_variance);
}

constexpr double kTimeout = 0.6;  // [s]

/// A drive on which scale optimization sees too few points all the while.
test::Recorder drive_unseen(StereoOdometryConfig config, int frames, int without_right) {
  config.scale.min_points = 1'000'000;
  config.scale_timeout_s = kTimeout;
  test::Recorder recorder;
  StereoOdometry odometry(config, test::test_cameras(), &recorder);
  for (int i = 0; i < frames; ++i) odometry.process(test::drive_frame(i));
  for (int i = frames; i < frames + without_right; ++i) {
    StereoFrame frame = test::drive_frame(i);
    frame.right.valid = false;
    odometry.process(frame);
  }
  return recorder;
}

TEST(HeldScale, IsAScaleThatIsObserved) {
  for (const OdometryMode mode : {OdometryMode::kScale, OdometryMode::kStereo}) {
    StereoOdometryConfig config = test::test_config();
    config.mode = mode;
    const test::Recorder recorder = drive_unseen(config, 30, 0);
    for (const OdometryOutput& out : recorder.frames) {
      EXPECT_EQ(out.state, OdometryState::kTracking) << out.reason;
    }
    const OdometryOutput& last = recorder.frames.back();
    EXPECT_EQ(last.scale_verdict, ScaleVerdict::kTooFewPoints);
    EXPECT_LT(last.scale_age_s, kTimeout);
    EXPECT_GT(last.log_scale_sigma, 5e-4);
    EXPECT_LT(last.log_scale_sigma, 0.01);
    const double way = last.T_odom_left.translation().norm();
    const double truth = test::drive(29).translation().norm();
    EXPECT_NEAR(std::log(way / truth), 0.0, 3.0 * last.log_scale_sigma);
  }
}

TEST(HeldScale, WithoutStaticResidualsItIsNot) {
  StereoOdometryConfig config = test::test_config();
  config.assist.hold_scale = false;
  const test::Recorder recorder = drive_unseen(config, 30, 0);
  const OdometryOutput& last = recorder.frames.back();
  EXPECT_EQ(last.state, OdometryState::kScaleUnobserved);
  EXPECT_GT(last.scale_age_s, kTimeout) << "since the map began";
}

TEST(HeldScale, WithoutRightImagesItIsNot) {
  const test::Recorder recorder = drive_unseen(test::test_config(), 20, 15);
  EXPECT_EQ(recorder.frames[19].state, OdometryState::kTracking);
  const OdometryOutput& last = recorder.frames.back();
  EXPECT_NE(last.state, OdometryState::kTracking);
  EXPECT_GT(last.scale_age_s, kTimeout);
}

}  // namespace
}  // namespace sovo
