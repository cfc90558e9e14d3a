#include "sovo/scale/scale_optimizer.h"

#include <gtest/gtest.h>

#include "scale/scale_test_support.h"

namespace sovo {
namespace {

using test::make_keyframe;
using test::PointErrors;
using test::pyramid_of;
using test::Right;
using test::scene;
using test::StereoView;
using test::view;

ScaleEstimate estimate(const StereoView& v, const KeyframeSnapshot& keyframe, bool cold_start,
                       const ScaleOptimizerConfig& config = {}) {
  return ScaleOptimizer(config, v.rig).estimate(keyframe, *pyramid_of(v.right), cold_start);
}

struct KnownScale {
  Right right;
  double scale;
};

class KnownScaleTest : public testing::TestWithParam<KnownScale> {};

TEST_P(KnownScaleTest, ColdStartFindsIt) {
  const auto [right, scale] = GetParam();
  const StereoView& v = view(right);
  const auto keyframe = make_keyframe(v, scene(1), {.log_scale = std::log(scale)});
  const ScaleEstimate found = estimate(v, keyframe, true);
  EXPECT_EQ(found.verdict, ScaleVerdict::kAccepted) << to_string(found.verdict);
  EXPECT_NEAR(found.log_scale, std::log(scale), 0.002);
  EXPECT_LT(found.ambiguity, 0.6);
  EXPECT_NEAR(found.gain, 1.0, 0.02);
  ASSERT_TRUE(found.turn.valid);
  EXPECT_LT(v.rig.right.fx * found.turn.turn.norm(), 0.1);
}

INSTANTIATE_TEST_SUITE_P(
    FourDecades, KnownScaleTest,
    testing::Values(KnownScale{Right::kRectified, 0.01}, KnownScale{Right::kRectified, 0.3},
                    KnownScale{Right::kRectified, 100.0}, KnownScale{Right::kRadtan, 0.01},
                    KnownScale{Right::kRadtan, 1.0}, KnownScale{Right::kRadtan, 20.0},
                    KnownScale{Right::kRadtan, 100.0}, KnownScale{Right::kEquidistant, 0.01},
                    KnownScale{Right::kEquidistant, 4.0}, KnownScale{Right::kEquidistant, 100.0}));

TEST(ScaleOptimizer, TracksFromTenPercentOff) {
  for (const Right right : {Right::kRectified, Right::kRadtan, Right::kEquidistant}) {
    for (const double log_scale : {-0.1, -0.01, 0.1}) {
      const StereoView& v = view(right);
      const auto keyframe = make_keyframe(v, scene(1), {.log_scale = log_scale});
      const ScaleEstimate found = estimate(v, keyframe, false);
      EXPECT_EQ(found.verdict, ScaleVerdict::kAccepted) << to_string(found.verdict);
      EXPECT_NEAR(found.log_scale, log_scale, 0.002);
      EXPECT_LT(std::abs(found.log_scale - log_scale), 4.0 * found.sigma);
      EXPECT_GT(found.inlier_ratio, 0.9);
    }
  }
}

TEST(ScaleOptimizer, KnowsWhereTheCameraWasAtTheOtherExposure) {
  StereoView v = view(Right::kRadtan);
  const SE3 T_later_left(SO3::exp(Vec3(0.003, -0.008, 0.004)), Vec3(0.03, -0.01, -0.05));
  v.right = scene(1).render(v.rig.right, (v.rig.T_right_left * T_later_left).inverse());
  for (const double log_scale : {-1.0, 0.05, 1.0}) {
    const auto keyframe = make_keyframe(v, scene(1), {.log_scale = log_scale});
    SE3 in_map = T_later_left;  // the map's lengths are too short by that much
    in_map.translation() *= std::exp(-log_scale);
    const ScaleOptimizer optimizer({}, v.rig);
    const auto right = pyramid_of(v.right);
    const ScaleEstimate found = optimizer.estimate(keyframe, *right, true, in_map);
    EXPECT_EQ(found.verdict, ScaleVerdict::kAccepted) << to_string(found.verdict);
    EXPECT_NEAR(found.log_scale, log_scale, 0.002);
    const ScaleEstimate ignorant = optimizer.estimate(keyframe, *right, true);
    EXPECT_GT(std::abs(ignorant.log_scale - log_scale), 0.01);
  }
}

TEST(ScaleOptimizer, FindsGainAndBiasBetweenTheCameras) {
  StereoView v = view(Right::kRadtan);
  test::apply_brightness(0.85, 12.0, &v.right);
  const auto keyframe = make_keyframe(v, scene(1), {.log_scale = 0.07});
  for (const bool cold : {false, true}) {
    const ScaleEstimate found = estimate(v, keyframe, cold);
    EXPECT_EQ(found.verdict, ScaleVerdict::kAccepted) << to_string(found.verdict);
    EXPECT_NEAR(found.log_scale, 0.07, 0.002);
    EXPECT_NEAR(found.gain, 0.85, 0.02);
    EXPECT_NEAR(found.bias, 12.0, 3.0);
  }
}

TEST(ScaleOptimizer, WithstandsWrongDepthsAndNoise) {
  StereoView v = view(Right::kRadtan);
  test::add_noise(3.0, 7, &v.left);
  test::add_noise(3.0, 8, &v.right);
  for (const double log_scale : {-0.08, 0.08}) {
    const PointErrors errors{
        .log_scale = log_scale, .relative_noise = 0.05, .outliers = 0.2, .count = 2000};
    const ScaleEstimate found = estimate(v, make_keyframe(v, scene(1), errors), false);
    EXPECT_EQ(found.verdict, ScaleVerdict::kAccepted) << to_string(found.verdict);
    EXPECT_NEAR(found.log_scale, log_scale, 0.008);
    EXPECT_NEAR(found.log_scale, log_scale, 4.0 * found.sigma);
  }
  const PointErrors errors{
      .log_scale = 2.0, .relative_noise = 0.05, .outliers = 0.2, .count = 2000};
  const ScaleEstimate cold = estimate(v, make_keyframe(v, scene(1), errors), true);
  EXPECT_EQ(cold.verdict, ScaleVerdict::kAccepted) << to_string(cold.verdict);
  EXPECT_NEAR(cold.log_scale, 2.0, 0.008);
}

TEST(ScaleOptimizer, SigmaIsHonest) {
  double nees = 0.0;
  int runs = 0;
  for (unsigned seed = 1; seed <= 54; ++seed) {
    const unsigned room = 1 + seed % 3;
    StereoView v = view(Right::kRadtan, room);
    test::add_noise(3.0, 100 + seed, &v.left);
    test::add_noise(3.0, 200 + seed, &v.right);
    const PointErrors errors{.log_scale = 0.02 * (seed % 5 - 2.0),
                             .relative_noise = 0.03,
                             .outliers = 0.05,
                             .count = 1000,
                             .seed = seed};
    const ScaleEstimate found = estimate(v, make_keyframe(v, scene(room), errors), false);
    ASSERT_EQ(found.verdict, ScaleVerdict::kAccepted);
    const double error = (found.log_scale - errors.log_scale) / found.sigma;
    nees += error * error;
    ++runs;
  }
  nees /= runs;
  RecordProperty("nees", std::to_string(nees));
  // kappa makes room for what real points add: errors that neighbours share.
  EXPECT_GT(nees, 0.15);
  EXPECT_LT(nees, 1.5);
}

TEST(ScaleOptimizer, RepetitiveTextureIsNotLocked) {
  // A fronto-parallel wall of vertical bars: every period of disparity fits.
  StereoView v{test::make_rig(Right::kRectified), {}, {}};
  const CameraModel& c = v.rig.left;
  v.left = ImageF(c.width, c.height);
  v.right = ImageF(c.width, c.height);
  const double depth = 4.0;  // disparity 13 px, period 11 px
  const auto bars = [](double x, double y) {
    return static_cast<float>(127.0 + 60.0 * std::sin(2.0 * M_PI * x / 11.0) +
                              20.0 * std::sin(2.0 * M_PI * y / 17.0));
  };
  for (int y = 0; y < c.height; ++y) {
    for (int x = 0; x < c.width; ++x) {
      v.left.at(x, y) = bars(x, y);
      v.right.at(x, y) = bars(x + c.fx * 0.2 / depth, y);
    }
  }
  KeyframeSnapshot keyframe;
  keyframe.camera = c;
  keyframe.pyramid = pyramid_of(v.left);
  std::mt19937 random(3);
  for (int i = 0; i < 1000; ++i) {
    keyframe.points.u.push_back(static_cast<float>(test::uniform(random, 5, c.width - 6)));
    keyframe.points.v.push_back(static_cast<float>(test::uniform(random, 5, c.height - 6)));
    keyframe.points.inverse_depth.push_back(static_cast<float>(1.0 / depth));
    keyframe.points.sigma.push_back(0.005F);
  }
  const ScaleEstimate found = estimate(v, keyframe, true);
  EXPECT_EQ(found.verdict, ScaleVerdict::kAmbiguous) << to_string(found.verdict);
  EXPECT_GT(found.ambiguity, 0.8);
}

TEST(ScaleOptimizer, NoBaselineIsUnobservable) {
  StereoView v = view(Right::kRectified);
  v.rig.T_right_left = SE3();
  v.right = v.left;
  const auto keyframe = make_keyframe(v, scene(1), {});
  for (const bool cold : {false, true}) {
    EXPECT_EQ(estimate(v, keyframe, cold).verdict, ScaleVerdict::kUnobservable);
  }
}

TEST(ScaleOptimizer, FarPointsAreUnobservable) {
  StereoView v = view(Right::kRectified);
  v.right = v.left;  // everything at infinity
  auto keyframe = make_keyframe(v, scene(1), {});
  for (float& inverse_depth : keyframe.points.inverse_depth) inverse_depth = 1e-3F;
  for (const bool cold : {false, true}) {
    const ScaleEstimate found = estimate(v, keyframe, cold);
    EXPECT_EQ(found.verdict, ScaleVerdict::kUnobservable) << to_string(found.verdict);
  }
}

TEST(ScaleOptimizer, FewPointsAreRefused) {
  const StereoView& v = view(Right::kRectified);
  const auto keyframe = make_keyframe(v, scene(1), {.count = 150});
  EXPECT_EQ(estimate(v, keyframe, false).verdict, ScaleVerdict::kTooFewPoints);
  EXPECT_FALSE(estimate(v, keyframe, false).out_of_view);
  EXPECT_EQ(estimate(v, keyframe, true).verdict, ScaleVerdict::kTooFewPoints);
}

TEST(ScaleOptimizer, ATooSmallMapLiesOutsideTheRightImageAndIsFoundAgain) {
  const StereoView& v = view(Right::kRectified);
  auto keyframe = make_keyframe(v, scene(1), {});
  for (float& inverse_depth : keyframe.points.inverse_depth) inverse_depth *= 30.0F;
  const ScaleEstimate tracked = estimate(v, keyframe, false);
  EXPECT_EQ(tracked.verdict, ScaleVerdict::kTooFewPoints);
  EXPECT_TRUE(tracked.out_of_view);
  const ScaleEstimate searched = estimate(v, keyframe, true);
  EXPECT_EQ(searched.verdict, ScaleVerdict::kAccepted);
  EXPECT_FALSE(searched.out_of_view);
  EXPECT_NEAR(searched.log_scale, std::log(30.0), 0.02);
}

TEST(ScaleOptimizer, PointsWithoutDepthAreLeftOut) {
  const StereoView& v = view(Right::kRectified);
  auto keyframe = make_keyframe(v, scene(1), {.log_scale = 0.05});
  for (std::size_t i = 0; i < keyframe.points.size(); i += 5) {
    keyframe.points.inverse_depth[i] = i % 2 == 0 ? NAN : -1.0F;
  }
  const ScaleEstimate found = estimate(v, keyframe, false);
  EXPECT_EQ(found.verdict, ScaleVerdict::kAccepted);
  EXPECT_NEAR(found.log_scale, 0.05, 0.002);
}

TEST(ScaleOptimizer, ASideWithoutImageIsSaid) {
  const StereoView& v = view(Right::kRectified);
  const auto keyframe = make_keyframe(v, scene(1), {});
  const ScaleOptimizer optimizer({}, v.rig);
  EXPECT_EQ(optimizer.estimate(keyframe, ImagePyramid(), false).verdict,
            ScaleVerdict::kNoRightImage);
}

TEST(ScaleOptimizer, ABlackRightImageIsUnobservable) {
  StereoView v = view(Right::kRectified);
  v.right.fill(0.0F);
  const auto keyframe = make_keyframe(v, scene(1), {});
  for (const bool cold : {false, true}) {
    const ScaleEstimate found = estimate(v, keyframe, cold);
    EXPECT_NE(found.verdict, ScaleVerdict::kAccepted) << found.log_scale;
  }
}

TEST(ScaleOptimizer, SwappedCamerasGiveNoScale) {
  StereoView v = view(Right::kRectified);
  std::swap(v.left, v.right);
  // The left camera's depths are as good as any for a monocular map of the other camera.
  const auto keyframe = make_keyframe(v, scene(1), {});
  for (const bool cold : {false, true}) {
    const ScaleEstimate found = estimate(v, keyframe, cold);
    EXPECT_NE(found.verdict, ScaleVerdict::kAccepted) << found.log_scale;
  }
}

TEST(ScaleOptimizer, HiddenPointsDoNotPull) {
  // A near board in front of a far wall, and points of the wall that only the left camera sees.
  const StereoView& v = view(Right::kRectified);
  const auto keyframe = make_keyframe(v, scene(1), {.log_scale = 0.03, .count = 3000});
  ScaleOptimizerConfig without;
  without.occlusion_ratio = 1e6;
  const ScaleEstimate with = estimate(v, keyframe, false);
  const ScaleEstimate all = estimate(v, keyframe, false, without);
  EXPECT_LT(with.num_points, all.num_points);
  EXPECT_GT(with.num_points, 0.9 * all.num_points);
  EXPECT_GE(with.inlier_ratio, all.inlier_ratio);
  EXPECT_NEAR(with.log_scale, 0.03, 0.002);
}

TEST(ScaleOptimizer, PapersMethodConvergesFromNear) {
  ScaleOptimizerConfig config;
  config.method = ScaleMethod::kPaper;
  for (const Right right : {Right::kRectified, Right::kRadtan}) {
    for (const double log_scale : {-0.1, 0.1}) {
      const StereoView& v = view(right);
      const auto keyframe = make_keyframe(v, scene(1), {.log_scale = log_scale});
      const ScaleEstimate found = estimate(v, keyframe, false, config);
      EXPECT_EQ(found.verdict, ScaleVerdict::kAccepted) << to_string(found.verdict);
      EXPECT_NEAR(found.log_scale, log_scale, 0.005);
    }
  }
}

TEST(ScaleOptimizer, PapersMethodStartsFromGuesses) {
  ScaleOptimizerConfig config;
  config.method = ScaleMethod::kPaper;
  const StereoView& v = view(Right::kRectified);
  const auto keyframe = make_keyframe(v, scene(1), {.log_scale = std::log(4.5)});
  const ScaleEstimate found = estimate(v, keyframe, true, config);
  EXPECT_EQ(found.verdict, ScaleVerdict::kAccepted) << to_string(found.verdict);
  EXPECT_NEAR(found.log_scale, std::log(4.5), 0.005);
}

TEST(ScaleOptimizer, PapersMethodLooksForNoTurn) {
  ScaleOptimizerConfig config;
  config.method = ScaleMethod::kPaper;
  const StereoView& v = view(Right::kRectified);
  EXPECT_FALSE(estimate(v, make_keyframe(v, scene(1), {}), false, config).turn.valid);
}

TEST(ScaleOptimizer, SameInputSameBytes) {
  const StereoView& v = view(Right::kEquidistant);
  const auto right = pyramid_of(v.right);
  const PointErrors errors{.log_scale = 0.05, .relative_noise = 0.05, .outliers = 0.1};
  const auto keyframe = make_keyframe(v, scene(1), errors);
  const auto other = make_keyframe(v, scene(1), {.log_scale = 3.0, .count = 2500});
  const ScaleOptimizer optimizer({}, v.rig);
  for (const bool cold : {false, true}) {
    const ScaleEstimate first = optimizer.estimate(keyframe, *right, cold);
    optimizer.estimate(other, *right, true);  // must leave nothing behind
    const ScaleEstimate second = optimizer.estimate(keyframe, *right, cold);
    EXPECT_EQ(first.log_scale, second.log_scale);
    EXPECT_EQ(first.sigma, second.sigma);
    EXPECT_EQ(first.residual, second.residual);
    EXPECT_EQ(first.iterations, second.iterations);
  }
}

}  // namespace
}  // namespace sovo
