#include "sovo/odometry/stereo_assist.h"

#include <gtest/gtest.h>

#include <map>

#include "odometry/odometry_test_support.h"

namespace sovo {
namespace {

constexpr double kFew = 0.2;
constexpr double kMiddling = 0.3;
constexpr double kMany = 0.8;
constexpr double kGood = 0.95;

TEST(StereoAssist, IsNotThereBeforeSomethingFails) {
  StereoAssist assist({});
  for (int i = 0; i < 5; ++i) {
    EXPECT_FALSE(assist.wanted());
    assist.on_keyframe(kMiddling, kGood);
    assist.on_scale(ScaleVerdict::kAccepted);
  }
}

TEST(StereoAssist, ComesWithTooFewPointsAndGoesAfterThreeGoodKeyframes) {
  StereoAssist assist({});
  assist.on_keyframe(kFew, kGood);
  EXPECT_TRUE(assist.wanted());
  for (int i = 0; i < 5; ++i) assist.on_keyframe(kMiddling, kGood);
  EXPECT_TRUE(assist.wanted()) << "not failing is not yet good";
  assist.on_keyframe(kMany, kGood);
  assist.on_keyframe(kMany, kGood);
  assist.on_keyframe(kMiddling, kGood);
  assist.on_keyframe(kMany, kGood);
  assist.on_keyframe(kMany, kGood);
  EXPECT_TRUE(assist.wanted()) << "three in a row";
  assist.on_keyframe(kMany, kGood);
  EXPECT_FALSE(assist.wanted());
}

TEST(StereoAssist, ComesWhenTrackingFitsBadly) {
  StereoAssist assist({});
  assist.on_keyframe(kMany, 0.5);
  EXPECT_TRUE(assist.wanted());
}

TEST(StereoAssist, ComesWhenTheScaleJumps) {
  StereoAssist assist({});
  assist.on_scale(ScaleVerdict::kInnovation);
  assist.on_keyframe(kMany, kGood);
  assist.on_scale(ScaleVerdict::kAccepted);
  assist.on_scale(ScaleVerdict::kInnovation);
  assist.on_keyframe(kMany, kGood);
  EXPECT_FALSE(assist.wanted()) << "two in a row";
  assist.on_scale(ScaleVerdict::kInnovation);
  assist.on_keyframe(kMany, kGood);
  EXPECT_TRUE(assist.wanted());
  assist.on_scale(ScaleVerdict::kAccepted);
  for (int i = 0; i < 3; ++i) assist.on_keyframe(kMany, kGood);
  EXPECT_FALSE(assist.wanted());
}

TEST(StereoAssist, HoldsTheScaleWhileNoneIsMeasured) {
  StereoAssist unaware({});
  for (const ScaleVerdict verdict :
       {ScaleVerdict::kAccepted, ScaleVerdict::kUnobservable, ScaleVerdict::kNoRightImage}) {
    unaware.on_scale(verdict);
    EXPECT_FALSE(unaware.holds_scale());
  }
  for (const ScaleVerdict fails : {ScaleVerdict::kTooFewPoints, ScaleVerdict::kInnovation}) {
    StereoAssist assist({});
    assist.on_scale(fails);
    assist.on_scale(ScaleVerdict::kAccepted);
    assist.on_scale(ScaleVerdict::kAccepted);
    assist.on_scale(ScaleVerdict::kUnobservable);
    assist.on_scale(ScaleVerdict::kAccepted);
    assist.on_scale(ScaleVerdict::kAccepted);
    EXPECT_TRUE(assist.holds_scale()) << "three in a row";
    assist.on_scale(ScaleVerdict::kAccepted);
    EXPECT_FALSE(assist.holds_scale());

    StereoAssist never({.hold_scale = false});
    never.on_scale(fails);
    EXPECT_FALSE(never.holds_scale());
  }
}

class StageCounter : public StageObserver {
 public:
  void on_stage(Stage stage, double /*seconds*/) override { ++counts[stage]; }
  void on_window(std::uint32_t /*points*/, std::uint32_t /*residuals*/) override {}
  std::map<Stage, int> counts;
};

/// How many of the drive's keyframes were matched, after the first frame, and how many there are.
struct Matched {
  int matched = 0, keyframes = 0;
};

Matched drive_matched(const StereoOdometryConfig& config) {
  test::Recorder recorder;
  StageCounter counter;
  StereoOdometry odometry(config, test::test_cameras(), &recorder, &counter);
  for (int i = 0; i < 25; ++i) odometry.process(test::drive_frame(i));
  EXPECT_TRUE(recorder.frames.back().pose_valid);
  return {counter.counts[Stage::kStaticMatching] - 1, counter.counts[Stage::kBundleAdjustment]};
}

TEST(StereoAssist, OnADriveItMatchesOnlyWhereTooFewPointsAreFound) {
  StereoOdometryConfig config = test::test_config();
  config.depth_init = DepthInit::kStereo;
  const Matched always = drive_matched(config);
  ASSERT_GT(always.keyframes, 4);
  EXPECT_EQ(always.matched, always.keyframes);

  config.depth_init = DepthInit::kAuto;
  config.assist.few_points = 0.01;
  EXPECT_EQ(drive_matched(config).matched, 0);
  config.assist.few_points = 2.0;  // never enough
  const Matched assisted = drive_matched(config);
  EXPECT_EQ(assisted.matched, assisted.keyframes - 1) << "all but the one that showed it";

  config.depth_init = DepthInit::kTemporal;
  EXPECT_EQ(drive_matched(config).matched, 0);
}

TEST(StereoAssist, StaticResidualsAlwaysHaveTheirMatches) {
  StereoOdometryConfig config = test::test_config();
  config.mode = OdometryMode::kStereo;
  config.depth_init = DepthInit::kAuto;
  config.assist.few_points = 0.01;
  const Matched matched = drive_matched(config);
  EXPECT_EQ(matched.matched, matched.keyframes);
}

}  // namespace
}  // namespace sovo
