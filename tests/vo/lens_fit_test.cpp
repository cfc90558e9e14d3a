#include "sovo/vo/lens_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "support/numeric.h"

namespace sovo {
namespace {

/// A keyframe that sees `value`, with this information.
LensEvidence keyframe_that_sees(const Vec2& value, double information = 1e6) {
  LensEvidence out;
  out.H << information, 0.4 * information, 0.4 * information, information;
  out.b = -out.H * value;
  out.turn = 0.3;
  return out;
}

/// Keyframes that see a focal length, each with errors of its own.
std::vector<LensEvidence> keyframes_that_see(double focal, double error, int n) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  std::vector<LensEvidence> out;
  for (int i = 0; i < n; ++i) {
    out.push_back(
        keyframe_that_sees({focal + error * normal(random), 0.002 + error * normal(random)}));
  }
  return out;
}

TEST(LensFit, IsTheMeanOfWhatKeyframesSee) {
  const auto fit = fit_lens(keyframes_that_see(0.012, 0.0, 25));
  ASSERT_TRUE(fit.has_value());
  EXPECT_NEAR(fit->change.focal, 0.012, 1e-9);
  EXPECT_NEAR(fit->change.radial, 0.002, 1e-9);
  EXPECT_LT(fit->sigma.focal, 1e-9);
}

TEST(LensFit, IsAsUncertainAsKeyframesScatter) {
  constexpr int kMany = 400;
  constexpr double kError = 0.01;
  const auto fit = fit_lens(keyframes_that_see(0.0, kError, kMany));
  ASSERT_TRUE(fit.has_value());
  const double expected = kError / std::sqrt(kMany);
  EXPECT_GT(fit->sigma.focal, 0.5 * expected);
  EXPECT_LT(fit->sigma.focal, 2.0 * expected);
}

TEST(LensFit, BelievesNoKeyframeMoreThanKeyframesErr) {
  auto keyframes = keyframes_that_see(0.01, 0.0, 39);
  keyframes.push_back(keyframe_that_sees({-0.01, 0.002}, 1e12));
  const auto fit = fit_lens(keyframes);
  ASSERT_TRUE(fit.has_value());
  EXPECT_GT(fit->change.focal, 0.008);
  EXPECT_GT(fit->sigma.focal, 1e-4) << "one of them sees quite another lens";
}

TEST(LensFit, NeedsTenKeyframes) {
  EXPECT_FALSE(fit_lens(keyframes_that_see(0.01, 0.001, 9)).has_value());
  EXPECT_TRUE(fit_lens(keyframes_that_see(0.01, 0.001, 10)).has_value());
}

/// Keyframes that see a focal length, between which the cameras turn by so much.
std::vector<LensEvidence> keyframes_that_turn(double turn, double focal, int n) {
  auto out = keyframes_that_see(focal, 0.001, n);
  for (LensEvidence& keyframe : out) keyframe.turn = turn;
  return out;
}

/// Seven degrees do not tell a focal length, nine do.
TEST(LensFit, CountsKeyframesThatTurn) {
  auto keyframes = keyframes_that_turn(0.16, 0.004, 12);
  const auto straight = keyframes_that_turn(0.12, -0.03, 60);
  EXPECT_FALSE(fit_lens(straight).has_value());
  keyframes.insert(keyframes.begin() + 4, straight.begin(), straight.end());
  const auto fit = fit_lens(keyframes);
  ASSERT_TRUE(fit.has_value());
  EXPECT_NEAR(fit->change.focal, 0.004, 0.001);
}

TEST(LensFit, IsNoneWhereNothingTells) {
  EXPECT_FALSE(fit_lens(std::vector<LensEvidence>(20)).has_value());
}

/// What the watch says after these keyframes.
double watched(const std::vector<LensEvidence>& keyframes) {
  LensWatch watch;
  for (const LensEvidence& keyframe : keyframes) watch.note(keyframe);
  return watch.focal_error();
}

TEST(LensWatch, TellsAFocalLengthThatAllSee) {
  EXPECT_NEAR(watched(keyframes_that_see(-0.015, 0.002, 30)), -0.015, 0.002);
  EXPECT_NEAR(watched(keyframes_that_see(0.015, 0.002, 30)), 0.015, 0.002);
}

TEST(LensWatch, WaitsForADozenKeyframes) {
  EXPECT_EQ(watched(keyframes_that_see(-0.02, 0.0, 11)), 0.0);
  EXPECT_NE(watched(keyframes_that_see(-0.02, 0.0, 12)), 0.0);
}

TEST(LensWatch, IsSilentAboutLittle) {
  EXPECT_EQ(watched(keyframes_that_see(-0.009, 0.0, 60)), 0.0);
}

TEST(LensWatch, IsSilentWhereKeyframesScatter) {
  EXPECT_EQ(watched(keyframes_that_see(-0.02, 0.1, 60)), 0.0);
}

TEST(LensWatch, IsSilentWhereATenthOfTheKeyframesMakesItAll) {
  auto keyframes = keyframes_that_see(0.0, 0.001, 54);
  for (int i = 0; i < 6; ++i) keyframes.push_back(keyframe_that_sees({-0.15, 0.0}));
  EXPECT_EQ(watched(keyframes), 0.0);
}

TEST(LensWatch, IsSilentOnStraightRoads) {
  EXPECT_EQ(watched(keyframes_that_turn(0.12, -0.03, 200)), 0.0);
  EXPECT_NE(watched(keyframes_that_turn(0.16, -0.03, 200)), 0.0);
  // A bend of the road, over several mean depths, is none.
  auto bend = keyframes_that_turn(0.2, -0.03, 200);
  for (LensEvidence& keyframe : bend) keyframe.way = 2.1;
  EXPECT_EQ(watched(bend), 0.0);
  for (LensEvidence& keyframe : bend) keyframe.way = 1.9;
  EXPECT_NE(watched(bend), 0.0);
}

TEST(LensWatch, RemembersWhatWasClear) {
  auto keyframes = keyframes_that_see(-0.02, 0.001, 30);
  const auto unclear = keyframes_that_see(0.0, 0.001, 200);
  keyframes.insert(keyframes.end(), unclear.begin(), unclear.end());
  EXPECT_LT(watched(keyframes), -0.01);
}

}  // namespace
}  // namespace sovo
