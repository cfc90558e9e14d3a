#include "sovo/vo/coarse_tracker.h"

#include <gtest/gtest.h>

#include "sovo/vo/direct_odometry.h"
#include "support/numeric.h"
#include "vo/window_test_support.h"

namespace sovo {
namespace {

using namespace test;

/// A reference of one keyframe with the true depths of the scene.
TrackingReference scene_reference(const SyntheticScene& scene, const Affine& affine = {}) {
  const Window window = window_of_one(scene, affine);
  return build_tracking_reference(window, active_points(window),
                                  window.newest().pyramid->num_levels(), 50.0);
}

/// A way along the view, and a little to the side.
const SE3 kMovedBesideBars(SO3::exp(Vec3(0.004, -0.006, 0.002)), Vec3(0.04, -0.02, -0.08));

class TrackerJacobian : public ::testing::TestWithParam<double> {};

TEST_P(TrackerJacobian, AgreesWithCentralDifferencesOnASmoothImage) {
  const double huber = GetParam();
  const CameraModel camera = make_camera(320, 240, 260, 255, 158.7, 121.3);
  const WaveImage wave{0.5};
  const ImageF image = wave.sampled(camera.width, camera.height);
  TrackingReference reference;
  reference.affine = {0.04, 3.0};
  reference.levels.resize(1);
  ReferenceLevel& level = reference.levels[0];
  level.camera = camera;
  std::mt19937 random(4);
  const SE3 T(SO3::exp(Vec3(0.02, -0.03, 0.04)), Vec3(0.1, -0.07, 0.12));
  const Affine affine{-0.05, -4.0};
  for (int i = 0; i < 203; ++i) {
    const double u = std::floor(uniform(random, 60, 260));
    const double v = std::floor(uniform(random, 60, 180));
    level.u.push_back(static_cast<float>(u));
    level.v.push_back(static_cast<float>(v));
    level.rho.push_back(static_cast<float>(uniform(random, 0.2, 0.8)));
    level.colour.push_back(static_cast<float>(wave(u, v) + uniform(random, -8, 8)));
    level.weight.push_back(static_cast<float>(uniform(random, 0.5, 1.5)));
  }
  using Residuals = Eigen::Matrix<double, 203, 1>;
  const auto residuals = [&](const Vec8& x) {
    const SE3 moved = SE3::exp(x.head<6>()) * T;
    const BrightnessTransfer t =
        brightness_transfer(reference.affine, 0.0, {affine.a + x[6], affine.b + x[7]}, 0.0);
    Residuals r;
    for (Eigen::Index i = 0; i < r.size(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      const Vec3 ray((level.u[k] - camera.cx) / camera.fx, (level.v[k] - camera.cy) / camera.fy, 1);
      const Vec2 at = *camera.project(moved.rotation_matrix() * ray +
                                      moved.translation() * static_cast<double>(level.rho[k]));
      r[i] = wave(at.x(), at.y()) - (t.gain * level.colour[k] + t.bias);
    }
    return r;
  };
  const Residuals r = residuals(Vec8::Zero());
  const Eigen::Matrix<double, 203, 8> J =
      central_differences<203, 8>(residuals, Vec8(Vec8::Zero()), 1e-5);
  const Residuals h = (huber / r.array().abs()).min(1.0);
  const Residuals given =
      Eigen::Map<const Eigen::Matrix<float, 203, 1>>(level.weight.data()).cast<double>();
  const Residuals w = given.cwiseProduct(h);
  const Mat8 H = J.transpose() * w.asDiagonal() * J;
  const Vec8 b = J.transpose() * w.cwiseProduct(r);
  const double energy =
      (w.array() * r.array().square() * (2.0 - h.array())).sum() / static_cast<double>(r.size());

  TrackerConfig config;
  config.huber = huber;
  CoarseTracker tracker(config);
  const auto found = tracker.linearize(
      reference, 0, image, T, brightness_transfer(reference.affine, 0, affine, 0), {huber, 1e3});
  ASSERT_EQ(found.inliers, 203);
  const Vec8 s = H.diagonal().cwiseSqrt().cwiseInverse();
  const Mat8 expected = s.asDiagonal() * H * s.asDiagonal();
  EXPECT_LT(relative_difference(Mat8(s.asDiagonal() * found.H * s.asDiagonal()), expected), 1e-3);
  EXPECT_LT(relative_difference(Vec8(s.cwiseProduct(found.b)), Vec8(s.cwiseProduct(b))), 1e-3);
  EXPECT_NEAR(found.energy, energy, 1e-3 * energy);
}

INSTANTIATE_TEST_SUITE_P(HuberThresholds, TrackerJacobian, ::testing::Values(1e4, 9.0, 2.0));

TEST(CoarseTracker, SaturatedResidualsLeaveTheNormalEquations) {
  const SyntheticScene scene(3);
  const TrackingReference reference = scene_reference(scene);
  const ImagePyramidPtr image = scene_view(scene, small_camera(), SE3(SO3(), Vec3(0.1, 0, 0)));
  CoarseTracker tracker{TrackerConfig()};
  const auto wide = tracker.linearize(reference, 0, image->level(0), SE3(), {}, {9.0, 1e3});
  const auto narrow = tracker.linearize(reference, 0, image->level(0), SE3(), {}, {9.0, 5.0});
  EXPECT_EQ(wide.inliers, wide.in_view);
  EXPECT_EQ(narrow.in_view, wide.in_view);
  EXPECT_LT(narrow.inliers, wide.inliers);
  EXPECT_NEAR(narrow.saturated, 1.0 - static_cast<double>(narrow.inliers) / narrow.in_view, 1e-12);
}

TEST(CoarseTracker, RecoversMotionGainAndBias) {
  const SyntheticScene scene(3);
  const CameraModel camera = small_camera();
  const Affine reference_affine{0.05, 2.0};
  const TrackingReference reference = scene_reference(scene, reference_affine);
  ASSERT_GT(reference.levels[0].size(), 500U);
  const SE3 truth(SO3::exp(Vec3(0.01, -0.02, 0.015)), Vec3(0.05, -0.03, 0.08));
  for (const auto& [gain, bias] : {std::pair(1.0, 0.0), std::pair(1.15, -6.0)}) {
    ImageF image = scene_view(scene, camera, truth.inverse())->level(0);
    apply_brightness(gain, bias, &image);
    CoarseTracker tracker{TrackerConfig()};
    const std::vector<SE3> start = {SE3()};
    const TrackingResult result =
        tracker.track(reference, *pyramid_of(std::move(image)), 0.0, reference_affine, start, {});
    ASSERT_TRUE(result.good);
    const SE3 error = result.T_current_reference * truth.inverse();
    EXPECT_LT(error.translation().norm(), 0.003);
    EXPECT_LT(error.rotation().log().norm(), 0.001);
    const BrightnessTransfer found = brightness_transfer(reference_affine, 0, result.affine, 0);
    EXPECT_NEAR(found.gain, gain, 0.03);
    // Gain and bias pull at each other; what they make of a mean grey level is well known.
    EXPECT_NEAR(found.gain * 127.5 + found.bias, gain * 127.5 + bias, 1.0);
    EXPECT_LT(result.rmse, 6.0);
    EXPECT_GT(result.inlier_ratio, 0.9);
    EXPECT_EQ(result.information, result.information.transpose());
  }
}

// The sensor clips what is brighter; taken as it is, that pulls at gain and motion.
TEST(CoarseTracker, WhitePixelsOfAnOverexposedImagePullAtNothing) {
  const SyntheticScene scene(3);
  const CameraModel camera = small_camera();
  const TrackingReference reference = scene_reference(scene);
  const SE3 truth(SO3::exp(Vec3(0.01, -0.02, 0.015)), Vec3(0.05, -0.03, 0.08));
  ImageF image = scene_view(scene, camera, truth.inverse())->level(0);
  constexpr double kGain = 1.9;
  apply_brightness(kGain, 0.0, &image);
  std::size_t white = 0;
  for (std::size_t i = 0; i < image.size(); ++i) {
    white += image.data()[i] > 255.0F ? 1 : 0;
    image.data()[i] = std::min(image.data()[i], 255.0F);
  }
  ASSERT_GT(static_cast<double>(white), 0.3 * static_cast<double>(image.size()));
  CoarseTracker tracker{TrackerConfig()};
  const std::vector<SE3> start = {SE3()};
  const TrackingResult result =
      tracker.track(reference, *pyramid_of(std::move(image)), 0.0, {}, start, {});
  ASSERT_TRUE(result.good);
  const SE3 error = result.T_current_reference * truth.inverse();
  EXPECT_LT(error.translation().norm(), 0.006);
  EXPECT_LT(error.rotation().log().norm(), 0.002);
  const BrightnessTransfer found = brightness_transfer({}, 0, result.affine, 0);
  EXPECT_NEAR(found.gain * 80.0 + found.bias, kGain * 80.0, 5.0);
  EXPECT_GT(result.inlier_ratio, 0.9);
}

TEST(CoarseTracker, TakesTheHypothesisThatFits) {
  const SyntheticScene scene(3);
  const TrackingReference reference = scene_reference(scene);
  const SE3 truth(SO3::exp(Vec3(0.0, 0.17, 0.0)), Vec3(0.05, 0, 0));
  const ImagePyramidPtr image = scene_view(scene, small_camera(), truth.inverse());
  CoarseTracker tracker{TrackerConfig()};
  const std::vector<SE3> hypotheses = {SE3(SO3::exp(Vec3(0, -0.25, 0)), Vec3::Zero()),
                                       SE3(SO3::exp(Vec3(0, 0.15, 0)), Vec3::Zero()),
                                       SE3(SO3::exp(Vec3(0, 0, 0.6)), Vec3::Zero())};
  const TrackingResult result = tracker.track(reference, *image, 0.0, {}, hypotheses, {});
  ASSERT_TRUE(result.good);
  EXPECT_EQ(result.hypothesis, 1);
  EXPECT_LT((result.T_current_reference * truth.inverse()).log().norm(), 0.006);
}

/// Weak texture that moves as the world does, and bars that move with the camera.
ImageF with_bars(const ImageF& scene) {
  ImageF image = scene;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      float& grey = image.at(x, y);
      grey = 110.0F + 0.12F * (grey - 128.0F);
      const bool bar = y > image.height() / 2 && (y / 16) % 2 == 0 && x > 160;
      if (bar) grey -= 40.0F;
    }
  }
  return image;
}

/// What is found where an eighth of what is seen moves with the camera.
TrackingResult tracked_beside_bars(double share) {
  const SyntheticScene scene(3);
  const CameraModel camera = small_camera();
  Window window(camera);
  const ImagePyramidPtr first = pyramid_of(with_bars(scene_view(scene, camera, SE3())->level(0)));
  Keyframe& k = window.insert(make_keyframe(1, first, SE3(), {}));
  k.points = scene_points(scene, camera, k.image(), {SE3()}, 0, 4);
  for (Point& p : k.points) p.hessian = 1e4;
  window.update_geometry();
  TrackingReference reference =
      build_tracking_reference(window, active_points(window), first->num_levels(), 50.0);
  reference.threshold_share = share;
  const ImagePyramidPtr second =
      pyramid_of(with_bars(scene_view(scene, camera, kMovedBesideBars.inverse())->level(0)));
  CoarseTracker tracker{TrackerConfig()};
  const std::vector<SE3> start = {SE3()};
  return tracker.track(reference, *second, 0.0, {}, start, {});
}

TEST(CoarseTracker, WithLowThresholdsAShadowDoesNotOutweighWeakTexture) {
  const TrackingResult low = tracked_beside_bars(0.25);
  ASSERT_TRUE(low.good);
  EXPECT_LT((low.T_current_reference * kMovedBesideBars.inverse()).log().norm(), 0.002);
  const TrackingResult usual = tracked_beside_bars(1.0);
  EXPECT_GT((usual.T_current_reference * kMovedBesideBars.inverse()).log().norm(), 0.008);
}

TEST(CoarseTracker, RefinesAMotionThatIsNearlyRightOnTheFinestLevelsAlone) {
  const SyntheticScene scene(3);
  const TrackingReference reference = scene_reference(scene);
  const SE3 truth(SO3::exp(Vec3(0.01, -0.02, 0.01)), Vec3(0.06, -0.03, 0.1));
  const ImagePyramidPtr image = scene_view(scene, small_camera(), truth.inverse());
  CoarseTracker tracker{TrackerConfig()};
  const LastTracking last{.rmse = 3.0, .inlier_ratio = 0.9};
  const SE3 near = SE3(SO3::exp(Vec3(0.002, 0.001, 0.0)), Vec3(0.004, 0.0, 0.004)) * truth;
  const TrackingResult found = tracker.refine(reference, *image, 0.0, {}, near, last);
  ASSERT_TRUE(found.good);
  EXPECT_TRUE(found.as_expected);
  EXPECT_LT((found.T_current_reference * truth.inverse()).log().norm(), 0.002);
  // What coarser levels show does not matter.
  TrackingReference misled = reference;
  ASSERT_GT(misled.levels.size(), 2U);
  for (std::size_t l = 2; l < misled.levels.size(); ++l) {
    for (float& u : misled.levels[l].u) u += 3.0F;
  }
  const TrackingResult same = tracker.refine(misled, *image, 0.0, {}, near, last);
  EXPECT_TRUE(same.T_current_reference.matrix() == found.T_current_reference.matrix());
  EXPECT_EQ(same.rmse, found.rmse);
}

std::vector<SE3> turns_of(double step, int most) {
  std::vector<SE3> out;
  for (int x = -most; x <= most; ++x) {
    for (int y = -most; y <= most; ++y) {
      for (int z = -2; z <= 2; ++z) {
        out.emplace_back(SO3::exp(step * Vec3(x, y, z)), Vec3::Zero());
      }
    }
  }
  return out;
}

TEST(CoarseTracker, RanksAKnockAmongManyTurns) {
  const SyntheticScene scene(3);
  const TrackingReference reference = scene_reference(scene);
  const SE3 truth(SO3::exp(Vec3(0.13, -0.16, 0.06)), Vec3(0.05, -0.02, 0.04));
  const ImagePyramidPtr image = scene_view(scene, small_camera(), truth.inverse());
  CoarseTracker tracker{TrackerConfig()};
  const std::vector<SE3> alone = {SE3()};
  const TrackingResult lost = tracker.track(reference, *image, 0.0, {}, alone, {3.0, 1.0});
  ASSERT_FALSE(lost.good && lost.as_expected) << "this turn is found without help";
  const std::vector<SE3> best = tracker.rank(reference, *image, 0.0, {}, turns_of(0.05, 4), 4);
  ASSERT_GE(best.size(), 2U);
  const TrackingResult found = tracker.track(reference, *image, 0.0, {}, best, {3.0, 1.0});
  ASSERT_TRUE(found.good);
  EXPECT_LT((found.T_current_reference * truth.inverse()).log().norm(), 0.006);
  for (std::size_t i = 1; i < best.size(); ++i) {
    const Vec6 apart = (best[i] * best[0].inverse()).log();
    EXPECT_GT(apart.norm(), 0.01) << "the same motion is offered twice";
  }
}

// After a frame that fitted badly, a wrong pose may have residuals that are no worse.
TEST(CoarseTracker, APoseThatHalfOfThePixelsDenyIsNotAsExpected) {
  const SyntheticScene scene(3);
  const TrackingReference reference = scene_reference(scene);
  const ImagePyramidPtr other = scene_view(SyntheticScene(11), small_camera(), SE3());
  const std::vector<SE3> start = {SE3()};
  TrackerConfig config;
  config.min_correlation = -1.0;
  const auto track = [&](const LastTracking& last) {
    return CoarseTracker(config).track(reference, *other, 0.0, {}, start, last);
  };
  const TrackingResult wrong = track({30.0, 1.0});
  ASSERT_TRUE(wrong.good) << "the test needs a pose that is taken";
  EXPECT_FALSE(wrong.as_expected);
  config.sure_inlier_ratio = 0.0;
  EXPECT_TRUE(track({30.0, 1.0}).as_expected);
}

// When images become blurred, right poses fit many times worse than the last one, and a wider
// search each time is for nothing.
TEST(CoarseTracker, APoseThatCorrelatesIsAsExpectedWhateverTheLastResidualsWere) {
  const SyntheticScene scene(3);
  const TrackingReference reference = scene_reference(scene);
  const SE3 truth(SO3::exp(Vec3(0.01, -0.02, 0.01)), Vec3(0.02, -0.01, 0.03));
  const ImagePyramidPtr image = scene_view(scene, small_camera(), truth.inverse());
  const std::vector<SE3> start = {SE3()};
  TrackerConfig config;
  const auto track = [&](const LastTracking& last) {
    return CoarseTracker(config).track(reference, *image, 0.0, {}, start, last);
  };
  const TrackingResult right = track({0.01, 1.0});
  ASSERT_TRUE(right.good);
  ASSERT_GT(right.rmse, config.lost_rmse_factor * 0.01);
  EXPECT_GT(right.correlation, config.sure_correlation);
  EXPECT_TRUE(right.as_expected);
  config.sure_correlation = 1.0;
  EXPECT_FALSE(track({0.01, 1.0}).as_expected);
  EXPECT_TRUE(track({right.rmse, 1.0}).as_expected) << "by its residuals";
}

// Whether a frame makes a good keyframe is judged by it.
TEST(CoarseTracker, BlurTakesTheSharpnessAwayAndGainAndBiasDoNot) {
  const SyntheticScene scene(3);
  const TrackingReference reference = scene_reference(scene);
  const ImageF sharp = scene_view(scene, small_camera(), SE3())->level(0);
  ImageF darker = sharp;
  for (std::size_t i = 0; i < darker.size(); ++i) darker.data()[i] = 20.0F + 0.6F * sharp.data()[i];
  ImageF smeared = sharp;
  for (int y = 0; y < sharp.height(); ++y) {
    for (int x = 3; x + 3 < sharp.width(); ++x) {
      float sum = 0.0F;
      for (int k = -3; k <= 3; ++k) sum += sharp.at(x + k, y);
      smeared.at(x, y) = sum / 7.0F;
    }
  }
  const auto sharpness = [&](const ImageF& image) {
    const std::vector<SE3> start = {SE3()};
    const TrackingResult result =
        CoarseTracker(TrackerConfig())
            .track(reference, *pyramid_of(image), 0.0, {}, start, {30.0, 0.5});
    EXPECT_TRUE(result.good);
    return result.sharpness;
  };
  const double of_sharp = sharpness(sharp);
  EXPECT_GT(of_sharp, 0.0);
  EXPECT_NEAR(sharpness(darker), of_sharp, 0.02 * of_sharp);
  EXPECT_LT(sharpness(smeared), KeyframeConfig().blurred_sharpness * of_sharp);
}

// Where a scene hides much of itself in every frame, a wider search each time is for nothing.
TEST(CoarseTracker, AsManyInliersAsInTheLastFrameAreAsExpected) {
  const SyntheticScene scene(3);
  const TrackingReference reference = scene_reference(scene);
  ImageF covered = scene_view(scene, small_camera(), SE3())->level(0);
  for (int y = 0; y < covered.height(); ++y) {
    for (int x = 0; x < covered.width() / 4; ++x) covered.at(x, y) = 200.0F;
  }
  const ImagePyramidPtr image = pyramid_of(std::move(covered));
  const std::vector<SE3> start = {SE3()};
  const auto track = [&](const LastTracking& last) {
    return CoarseTracker(TrackerConfig()).track(reference, *image, 0.0, {}, start, last);
  };
  const TrackingResult first = track({30.0, 0.95});
  ASSERT_TRUE(first.good);
  ASSERT_LT(first.inlier_ratio, TrackerConfig().sure_inlier_ratio);
  EXPECT_FALSE(first.as_expected);
  EXPECT_TRUE(track({30.0, first.inlier_ratio}).as_expected);
}

// What hides a third of the reference, a lorry that turns, takes its correlation.
TEST(CoarseTracker, APoseToWhichTheMotionLedNeedsLessCorrelation) {
  const SyntheticScene scene(3);
  const TrackingReference reference = scene_reference(scene);
  ImageF covered = scene_view(scene, small_camera(), SE3())->level(0);
  for (int y = 0; y < covered.height(); ++y) {
    for (int x = 0; x < covered.width() / 3; ++x) {
      covered.at(x, y) = (x / 30 + y / 30) % 2 == 0 ? 10.0F : 245.0F;
    }
  }
  const ImagePyramidPtr image = pyramid_of(std::move(covered));
  const auto track = [&](const std::optional<SE3>& expected) {
    const std::vector<SE3> start = {SE3()};
    return CoarseTracker(TrackerConfig())
        .track(reference, *image, 0.0, {}, start, {30.0, 0.95, expected});
  };
  const TrackingResult anywhere = track(std::nullopt);
  ASSERT_LT(anywhere.T_current_reference.log().norm(), 0.01);
  ASSERT_LT(anywhere.correlation, TrackerConfig().min_correlation);
  ASSERT_GT(anywhere.correlation, TrackerConfig().min_correlation_on_way);
  EXPECT_FALSE(anywhere.good);
  EXPECT_TRUE(track(SE3()).good);
  EXPECT_FALSE(track(SE3(SO3::exp(Vec3(0, 0.06, 0)), Vec3::Zero())).good);
  EXPECT_FALSE(track(SE3(SO3(), Vec3(0, 0, 0.1 / reference.mean_rho))).good);
}

// A small gain takes the reference's contrast away: residuals alone let such an image pass.
TEST(CoarseTracker, UnrelatedSceneOfSmallResidualsIsLost) {
  const SyntheticScene scene(3);
  const CameraModel camera = small_camera();
  const TrackingReference reference = scene_reference(scene);
  const std::vector<SE3> start = {SE3()};
  const ImagePyramidPtr other = scene_view(SyntheticScene(11), camera, SE3());
  TrackerConfig config;
  EXPECT_FALSE(CoarseTracker(config).track(reference, *other, 0.0, {}, start, {3.0, 1.0}).good);
  config.min_correlation = -1.0;
  EXPECT_TRUE(CoarseTracker(config).track(reference, *other, 0.0, {}, start, {3.0, 1.0}).good)
      << "residuals alone tell this one; the test needs another";
  config = {};
  ImageF faint = (*scene_view(scene, camera, SE3()))[0];
  for (std::size_t i = 0; i < faint.size(); ++i) faint.data()[i] = 60.0F + 0.4F * faint.data()[i];
  const TrackingResult seen =
      CoarseTracker(config).track(reference, *pyramid_of(faint), 0.0, {}, start, {3.0, 1.0});
  EXPECT_TRUE(seen.good);
  EXPECT_GT(seen.correlation, 0.95);
}

TEST(CoarseTracker, UnrelatedOrEmptyImageIsLost) {
  const SyntheticScene scene(3);
  const CameraModel camera = small_camera();
  const TrackingReference reference = scene_reference(scene);
  CoarseTracker tracker{TrackerConfig()};
  const std::vector<SE3> start = {SE3()};
  ImageF noise(camera.width, camera.height);
  std::mt19937 random(8);
  for (std::size_t i = 0; i < noise.size(); ++i) {
    noise.data()[i] = static_cast<float>(uniform(random) < 0.5 ? 0.0 : 255.0);
  }
  EXPECT_FALSE(tracker.track(reference, *pyramid_of(noise), 0.0, {}, start, {3.0, 1.0}).good);
  noise.fill(255.0F);
  EXPECT_FALSE(tracker.track(reference, *pyramid_of(noise), 0.0, {}, start, {3.0, 1.0}).good)
      << "white";
  noise.fill(std::numeric_limits<float>::quiet_NaN());
  EXPECT_FALSE(tracker.track(reference, *pyramid_of(noise), 0.0, {}, start, {3.0, 1.0}).good);
  const std::vector<SE3> away = {SE3(SO3::exp(Vec3(0, M_PI, 0)), Vec3::Zero())};
  const ImagePyramidPtr same = scene_view(scene, camera, SE3());
  EXPECT_FALSE(tracker.track(reference, *same, 0.0, {}, away, {3.0, 1.0}).good)
      << "nothing is in view";
}

TEST(TrackingReference, HoldsDepthsAtEveryLevelAndScales) {
  const SyntheticScene scene(3);
  const TrackingReference reference = scene_reference(scene);
  for (std::size_t l = 0; l < reference.levels.size(); ++l) {
    const ReferenceLevel& level = reference.levels[l];
    ASSERT_GT(level.size(), 20U) << "level " << l;
    std::vector<double> errors;
    for (std::size_t i = 0; i < level.size(); ++i) {
      const double depth = scene.depth(level.camera, SE3(), Vec2(level.u[i], level.v[i]));
      errors.push_back(std::abs(level.rho[i] * depth - 1.0));
    }
    std::nth_element(errors.begin(), errors.begin() + errors.size() / 2, errors.end());
    EXPECT_LT(errors[errors.size() / 2], 0.04) << "level " << l;
  }
  const TrackingReference twice = rescaled(reference, 2.0);
  EXPECT_FLOAT_EQ(twice.levels[0].rho[5], reference.levels[0].rho[5] / 2.0F);
  EXPECT_DOUBLE_EQ(twice.mean_rho, reference.mean_rho / 2.0);
  EXPECT_DOUBLE_EQ(twice.log_scale, std::log(2.0));
}

TEST(TrackingReferenceOfARollingShutter, ShowsEachPointWhereItsRowsDo) {
  const SyntheticScene scene(5);
  TrackingReference reference = scene_reference(scene);
  const double middle = 0.5 * (small_camera().height - 1);
  reference.shift = {.per_row = Vec3(2e-4, 1e-4, -5e-4), .middle = middle};
  const ViewShift rows{.per_row = Vec3(-1e-4, 2e-4, -6e-4), .middle = middle};
  const SE3 T(SO3::exp(Vec3(0.01, -0.02, 0.015)), Vec3(0.05, -0.02, -0.2));
  const TrackingReference moved = moved_by_shift(reference, rows, T);
  for (std::size_t l = 0; l < 2; ++l) {
    const ReferenceLevel& level = reference.levels[l];
    const CameraModel& camera = level.camera;
    ASSERT_EQ(moved.levels[l].size(), level.size());
    double most = 0.0;
    for (std::size_t i = 0; i < level.size(); ++i) {
      const auto row = [&](double v) { return (v + 0.5) * (1 << l) - 0.5; };
      const auto point = [&](const ReferenceLevel& of) -> Vec3 {
        return Vec3((of.u[i] - camera.cx) / camera.fx, (of.v[i] - camera.cy) / camera.fy, 1.0) /
               static_cast<double>(of.rho[i]);
      };
      // At the reference's instant, at the image's, and in the row that shows it.
      const Vec3 in_image = T * (point(level) - reference.shift.at(0.0, row(level.v[i])));
      Vec2 seen = *camera.project(in_image);
      for (int k = 0; k < 3; ++k) seen = *camera.project(in_image + rows.at(0.0, row(seen.y())));
      const Vec2 found = *camera.project(T * point(moved.levels[l]));
      const double displacement = (seen - *camera.project(T * point(level))).norm();
      // By one instant it is seen some rows from where it is seen: by so much the less, or more, it
      // moves until then.
      EXPECT_LT((found - seen).norm(), 0.01 + 0.03 * displacement) << "level " << l << " " << i;
      most = std::max(most, displacement);
    }
    EXPECT_GT(most, 1.0) << "or the rows do nothing";
  }
}

}  // namespace
}  // namespace sovo
