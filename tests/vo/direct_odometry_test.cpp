#include "sovo/vo/direct_odometry.h"

#include <gtest/gtest.h>

#include "sovo/geometry/pose_covariance.h"
#include "vo/window_test_support.h"

namespace sovo {
namespace {

using namespace test;

MonoFrame frame_at(const SyntheticScene& scene, const SE3& T_world_camera, int index) {
  MonoFrame frame;
  frame.stamp_ns = 1'000'000'000LL + 50'000'000LL * index;
  frame.pyramid = scene_view(scene, small_camera(), T_world_camera);
  return frame;
}

DirectConfig small_config() {
  DirectConfig config;
  config.points.active_points = 500;
  config.points.immature_points = 400;
  return config;
}

/// A map of one keyframe at the origin, with true depths of a scene.
class Map : public ::testing::Test {
 protected:
  Map() : pool_(1), vo_(small_config(), small_camera(), ImageU8(), 0, &pool_) {
    first_ = frame_at(scene_, SE3(), 0);
    std::vector<StartPoint> points;
    for (const SelectedPixel& pixel : vo_.select_pixels(first_, 700)) {
      const auto rho =
          static_cast<float>(1.0 / scene_.depth(small_camera(), SE3(), Vec2(pixel.x, pixel.y)));
      points.push_back({pixel, {rho, 0.02F * rho}});
    }
    vo_.begin(first_, SE3(), points, nullptr);
  }

  SyntheticScene scene_{3};
  WorkerPool pool_;
  DirectOdometry vo_;
  MonoFrame first_;
};

class FirstMotion : public Map, public ::testing::WithParamInterface<Vec3> {};

TEST_P(FirstMotion, IsFoundThoughNothingIsKnownOfIt) {
  // A vehicle may already move when the map begins: steps of many pixels.
  const SE3 truth(SO3::exp(Vec3(0.004, -0.006, 0.002)), GetParam());
  const TrackedFrame tracked = vo_.track(frame_at(scene_, truth, 1), 0.0);
  ASSERT_TRUE(tracked.tracking.good);
  const SE3 error = tracked.T_world_camera.inverse() * truth;
  EXPECT_LT(error.translation().norm(), 0.02);
  EXPECT_LT(error.rotation().log().norm(), 0.004);
}

INSTANTIATE_TEST_SUITE_P(Steps, FirstMotion,
                         ::testing::Values(Vec3(0.02, 0, 0.01), Vec3(0, 0, 0.6), Vec3(0.45, 0, 0),
                                           Vec3(-0.3, 0, 0.1)));

TEST_F(Map, UnrelatedImageIsLostAndTheMapGoesOn) {
  MonoFrame other = frame_at(scene_, SE3(), 1);
  ImageF checks(small_camera().width, small_camera().height);
  for (int y = 0; y < checks.height(); ++y) {
    for (int x = 0; x < checks.width(); ++x) {
      checks.at(x, y) = (x / 11 + y / 7) % 2 == 0 ? 10.0F : 240.0F;
    }
  }
  other.pyramid = pyramid_of(std::move(checks));
  EXPECT_FALSE(vo_.track(other, 0.0).tracking.good);
  EXPECT_TRUE(vo_.track(frame_at(scene_, SE3(SO3(), Vec3(0.02, 0, 0)), 2), 0.0).tracking.good);
}

TEST_F(Map, APoseOutOfReachIsNone) {
  for (int i = 1; i <= 2; ++i) {
    const SE3 slow(SO3(), Vec3(0.01 * i, 0, 0));
    ASSERT_TRUE(vo_.track(frame_at(scene_, slow, i), 50.0).tracking.good);
  }
  // From 0.2 m/s to 6 m/s in one frame: 116 m/s^2.
  const MonoFrame leap = frame_at(scene_, SE3(SO3(), Vec3(0.32, 0, 0)), 3);
  const FrameTracking refused = vo_.track(leap, 50.0).tracking;
  EXPECT_FALSE(refused.good);
  EXPECT_TRUE(refused.out_of_reach);
  EXPECT_TRUE(vo_.track(leap, 140.0).tracking.good);
}

TEST_F(Map, ErrorsOfFastFramesAreNoAcceleration) {
  // A millisecond apart, 6 mm beside the way would be 6000 m/s^2.
  for (int i = 1; i <= 6; ++i) {
    const SE3 jittering(SO3(), Vec3(0.01 + (i % 3 == 0 ? 0.006 : 0.0), 0, 0));
    MonoFrame frame = frame_at(scene_, jittering, 0);
    frame.stamp_ns += 1'000'000LL * i;
    EXPECT_TRUE(vo_.track(frame, 100.0).tracking.good) << "frame " << i;
  }
}

TEST_F(Map, AnyLeapIsTakenWhereNoLimitIsKnown) {
  for (int i = 1; i <= 2; ++i) {
    const SE3 slow(SO3(), Vec3(0.01 * i, 0, 0));
    ASSERT_TRUE(vo_.track(frame_at(scene_, slow, i), 0.0).tracking.good);
  }
  EXPECT_TRUE(vo_.track(frame_at(scene_, SE3(SO3(), Vec3(0.32, 0, 0)), 3), 0.0).tracking.good);
}

/// Poses of a drive: forward and to the side, turning a little.
SE3 drive(int i) {
  const double s = 0.035 * i;
  return {SO3::exp(Vec3(0.01 * std::sin(3 * s), -0.03 * s, 0.0)),
          Vec3(1.1 * s, 0.05 * std::sin(4 * s), 0.5 * s)};
}

TEST_F(Map, GrowsAlongADriveAndKeepsItsScaleInEverySimilarity) {
  // Corrections of scale in the middle: positions measured afterwards are in the new unit.
  double scale = 1.0;
  Vec3 shift = Vec3::Zero();
  int keyframes = 1;
  for (int i = 1; i <= 36; ++i) {
    const TrackedFrame tracked = vo_.track(frame_at(scene_, drive(i), i), 0.0);
    ASSERT_TRUE(tracked.tracking.good) << "frame " << i;
    const Vec3 expected = scale * drive(i).translation() + shift;
    EXPECT_LT((tracked.T_world_camera.translation() - expected).norm(), 0.03 * scale)
        << "frame " << i;
    const MapResult result = vo_.map(tracked, {}, nullptr);
    ASSERT_FALSE(result.failed);
    keyframes += result.is_keyframe ? 1 : 0;
    if (i == 12 || i == 18) {
      const double factor = i == 12 ? 1.4 : 0.6;
      ASSERT_TRUE(vo_.snapshot());
      ScaleCorrection correction;
      correction.keyframe_id = vo_.snapshot()->id;
      correction.scale_epoch = vo_.snapshot()->scale_epoch;
      correction.log_scale = vo_.log_scale() - vo_.snapshot()->log_scale + std::log(factor);
      const Vec3 fixed = vo_.window().newest().T_world_camera().translation();
      EXPECT_NEAR(vo_.apply(correction), std::log(factor), 1e-12);
      EXPECT_LT((vo_.window().newest().T_world_camera().translation() - fixed).norm(), 1e-9);
      shift = factor * shift + (1.0 - factor) * fixed;
      scale *= factor;
    }
  }
  EXPECT_NEAR(vo_.log_scale(), std::log(scale), 1e-12);
  EXPECT_GE(keyframes, 4);
  EXPECT_LE(vo_.window().size(), DirectConfig().keyframe.max_keyframes);
  EXPECT_EQ(vo_.keyframes().size(), static_cast<std::size_t>(keyframes));
}

TEST_F(Map, CovarianceIsCarriedOverEachStepAndGrowsByIt) {
  EXPECT_TRUE(vo_.reference()->covariance.isZero(0.0)) << "the first keyframe is the origin";
  Mat6 before = Mat6::Zero();  // of the keyframe before, where it is
  Vec3 position = vo_.reference()->T_world_camera.translation();
  int steps = 0;
  for (int i = 1; i <= 36; ++i) {
    const MapResult result = vo_.map(vo_.track(frame_at(scene_, drive(i), i), 0.0), {}, nullptr);
    if (!result.is_keyframe) continue;
    ++steps;
    const SE3 newest = vo_.reference()->T_world_camera;
    const Mat6 step = rotated(newest.rotation(), result.bundle.newest_covariance);
    EXPECT_GT(step.diagonal().minCoeff(), 0.0);
    EXPECT_NE(result.bundle.gradient_scatter, 1.0) << "measured";
    EXPECT_EQ(vo_.tracking_reference()->gradient_scatter, result.bundle.gradient_scatter);
    const Mat6 expected = carried(before, newest.translation() - position) + step;
    before = carried(vo_.reference()->covariance, newest.translation());
    position = newest.translation();
    EXPECT_TRUE(before.isApprox(expected, 1e-9)) << before << "\n\n" << expected;
  }
  EXPECT_GE(steps, 3);
}

TEST_F(Map, BeginsAnewWithoutWhatItHeld) {
  for (int i = 1; i <= 10; ++i) {
    vo_.map(vo_.track(frame_at(scene_, drive(i), i), 0.0), {}, nullptr);
  }
  ASSERT_GT(vo_.keyframes().size(), 1U);
  std::vector<StartPoint> points;
  for (const SelectedPixel& pixel : vo_.select_pixels(first_, 700)) {
    const double depth = scene_.depth(small_camera(), SE3(), Vec2(pixel.x, pixel.y));
    points.push_back({pixel, {static_cast<float>(1.0 / depth), static_cast<float>(0.02 / depth)}});
  }
  const MonoFrame again = frame_at(scene_, SE3(), 11);
  vo_.begin(again, SE3(), points, nullptr);
  ASSERT_EQ(vo_.keyframes().size(), 1U);
  EXPECT_EQ(vo_.keyframes()[0].stamp_ns, again.stamp_ns);
  ASSERT_EQ(vo_.window().size(), 1);
  EXPECT_EQ(vo_.window().newest().id, 0U);
  const std::vector<KeyframeState> states = vo_.window_keyframes();
  ASSERT_EQ(states.size(), 1U);
  EXPECT_LE(states[0].points.size(), points.size()) << "its own, and no others";
  const TrackedFrame tracked = vo_.track(frame_at(scene_, drive(1), 12), 0.0);
  ASSERT_TRUE(tracked.tracking.good);
  EXPECT_LT((tracked.T_world_camera.translation() - drive(1).translation()).norm(), 0.02);
}

TEST_F(Map, CorrectionCountsLessWhatWasAppliedSinceItsSnapshot) {
  for (int i = 1; !vo_.snapshot() && i < 20; ++i) {
    vo_.map(vo_.track(frame_at(scene_, drive(i), i), 0.0), {}, nullptr);
  }
  ASSERT_TRUE(vo_.snapshot());
  ScaleCorrection late;
  late.keyframe_id = vo_.snapshot()->id;
  late.scale_epoch = vo_.snapshot()->scale_epoch;
  late.log_scale = 0.3;
  EXPECT_NEAR(vo_.apply(late), 0.3, 1e-12);
  EXPECT_NEAR(vo_.apply(late), 0.0, 1e-12) << "the same measurement enters once";
  EXPECT_NEAR(vo_.reference()->log_scale, 0.3, 1e-12);
}

TEST_F(Map, SnapshotShowsTheTrueDepths) {
  int last = 0;
  for (int i = 1; i <= 14; ++i) {
    const MapResult r = vo_.map(vo_.track(frame_at(scene_, drive(i), i), 0.0), {}, nullptr);
    if (r.is_keyframe) last = i;
  }
  ASSERT_TRUE(vo_.snapshot());
  const KeyframeSnapshot& s = *vo_.snapshot();
  EXPECT_EQ(s.stamp_ns, frame_at(scene_, SE3(), last).stamp_ns);
  ASSERT_GT(s.points.size(), 100U);
  std::vector<double> errors;
  for (std::size_t k = 0; k < s.points.size(); ++k) {
    const Vec2 pixel(s.points.u[k], s.points.v[k]);
    const double depth = scene_.depth(small_camera(), drive(last), pixel);
    errors.push_back(std::abs(s.points.inverse_depth[k] * depth - 1.0));
    EXPECT_GT(s.points.sigma[k], 0.0F);
  }
  std::nth_element(errors.begin(), errors.begin() + errors.size() / 2, errors.end());
  EXPECT_LT(errors[errors.size() / 2], 0.03);
}

TEST(DirectOdometryThreads, ChangeNoBit) {
  const SyntheticScene scene(3);
  std::vector<MonoFrame> frames;
  for (int i = 0; i <= 10; ++i) frames.push_back(frame_at(scene, drive(i), i));
  std::vector<Mat4> poses[2];
  for (const int threads : {1, 2}) {
    WorkerPool pool(threads);
    DirectOdometry vo(small_config(), small_camera(), ImageU8(), 5, &pool);
    std::vector<StartPoint> points;
    for (const SelectedPixel& pixel : vo.select_pixels(frames[0], 700)) {
      const auto rho =
          static_cast<float>(1.0 / scene.depth(small_camera(), SE3(), Vec2(pixel.x, pixel.y)));
      points.push_back({pixel, {rho, 0.02F * rho}});
    }
    vo.begin(frames[0], SE3(), points, nullptr);
    for (std::size_t i = 1; i < frames.size(); ++i) {
      const TrackedFrame tracked = vo.track(frames[i], 0.0);
      poses[threads - 1].push_back(tracked.T_world_camera.matrix());
      vo.map(tracked, {}, nullptr);
    }
  }
  ASSERT_EQ(poses[0].size(), 10U);
  for (std::size_t i = 0; i < 10; ++i) EXPECT_EQ(poses[0][i], poses[1][i]) << "frame " << i + 1;
}

}  // namespace
}  // namespace sovo
