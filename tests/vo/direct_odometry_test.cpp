#include "sovo/vo/direct_odometry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "sovo/vo/vignette_estimate.h"
#include "vo/drive_test_support.h"

namespace sovo {
namespace {

using namespace test;

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
    begin(first_, &vo_);
  }

  void begin(const MonoFrame& first, DirectOdometry* vo) {
    std::vector<StartPoint> points;
    for (const SelectedPixel& pixel : vo->select_pixels(first, 700)) {
      const auto rho =
          static_cast<float>(1.0 / scene_.depth(small_camera(), SE3(), Vec2(pixel.x, pixel.y)));
      points.push_back({pixel, {rho, 0.02F * rho}});
    }
    vo->begin(first, SE3(), points, nullptr);
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

TEST_F(Map, ScatterOfGradientsGoesOnToTheReference) {
  int keyframes = 0;
  for (int i = 1; i <= 20; ++i) {
    const MapResult result = vo_.map(vo_.track(frame_at(scene_, drive(i), i), 0.0), {}, nullptr);
    if (!result.is_keyframe) continue;
    ++keyframes;
    EXPECT_NE(result.bundle.gradient_scatter, 1.0) << "measured";
    EXPECT_EQ(vo_.tracking_reference()->gradient_scatter, result.bundle.gradient_scatter);
  }
  EXPECT_GE(keyframes, 2);
}

/// What the scene looks like through a lens that darkens the corners.
MonoFrame darkened(MonoFrame frame) {
  const OffAxis off_axis(small_camera());
  const RadialVignette vignette{{-0.5, 0.0, 0.0}};
  const ImageF s = off_axis.of(small_camera());
  ImageF image = frame.pyramid->level(0);
  for (std::size_t i = 0; i < image.size(); ++i) {
    image.data()[i] *= static_cast<float>(std::exp(vignette.log_at(s.data()[i])));
  }
  frame.pyramid = pyramid_of(std::move(image));
  return frame;
}

TEST_F(Map, AVignetteIsTakenFromFramesWhoseMotionIsSure) {
  for (const bool doubtful : {false, true}) {
    VignetteEstimate vignette(small_camera());
    DirectOdometry vo(small_config(), small_camera(), ImageU8(), 0, &pool_, {&vignette, nullptr});
    begin(darkened(first_), &vo);
    int keyframes = 0;
    for (int i = 1; i <= 20; ++i) {
      TrackedFrame tracked = vo.track(darkened(frame_at(scene_, drive(i), i)), 0.0);
      ASSERT_TRUE(tracked.tracking.good) << i;
      tracked.tracking.motion_denied = doubtful;
      keyframes += vo.map(tracked, {}, nullptr).is_keyframe ? 1 : 0;
    }
    EXPECT_GE(keyframes, 2);
    EXPECT_EQ(vignette.current().any(), !doubtful);
  }
}

/// With a fifteenth of the contrast thresholds are at their least, for frames and for the window.
TEST_F(Map, ThresholdsComeDownWhereTextureIsWeak) {
  EXPECT_EQ(vo_.tracking_reference()->threshold_share, 1.0);
  EXPECT_EQ(vo_.window().newest().huber_share, 1.0);
  const auto pale = [&](const SE3& pose, int index) {
    MonoFrame frame = frame_at(scene_, pose, index);
    ImageF image = frame.pyramid->level(0);
    apply_brightness(0.07, 100.0, &image);
    frame.pyramid = pyramid_of(std::move(image));
    return frame;
  };
  const MonoFrame first = pale(SE3(), 0);
  std::vector<StartPoint> points;
  for (const SelectedPixel& pixel : vo_.select_pixels(first, 700)) {
    const double depth = scene_.depth(small_camera(), SE3(), Vec2(pixel.x, pixel.y));
    points.push_back({pixel, {static_cast<float>(1.0 / depth), static_cast<float>(0.02 / depth)}});
  }
  vo_.begin(first, SE3(), points, nullptr);
  const double least = DirectConfig().weak_texture.least_share;
  EXPECT_EQ(vo_.tracking_reference()->threshold_share, least);
  EXPECT_EQ(vo_.window().newest().huber_share, least);
  int keyframes = 0;
  for (int i = 1; i <= 20; ++i) {
    const TrackedFrame tracked = vo_.track(pale(drive(i), i), 0.0);
    ASSERT_TRUE(tracked.tracking.good) << i;
    if (!vo_.map(tracked, {}, nullptr).is_keyframe) continue;
    ++keyframes;
    EXPECT_EQ(vo_.tracking_reference()->threshold_share, least);
    EXPECT_EQ(vo_.window().newest().huber_share, least);
  }
  EXPECT_GE(keyframes, 2);
}

/// Of a first keyframe all pixels count, for those that have a depth are the strong ones.
TEST_F(Map, PixelsWithoutDepthTellOfWeakTextureToo) {
  const ImageF& full = first_.pyramid->level(0);
  ImageF image = full;
  int with_depth = 0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = image.width() / 3; x < image.width(); ++x) {
      image.at(x, y) = 100.0F + 0.07F * image.at(x, y);
    }
  }
  MonoFrame frame = first_;
  frame.pyramid = pyramid_of(std::move(image));
  std::vector<StartPoint> points;
  for (int y = 10; y + 10 < small_camera().height; y += 4) {
    for (int x = 10; x + 10 < small_camera().width; x += 4) {
      const float gx = 0.5F * (full.at(x + 1, y) - full.at(x - 1, y));
      const float gy = 0.5F * (full.at(x, y + 1) - full.at(x, y - 1));
      const bool strong = x + 8 < small_camera().width / 3 && std::hypot(gx, gy) > 15.0F;
      with_depth += strong ? 1 : 0;
      SelectedPixel pixel;
      pixel.x = static_cast<std::int16_t>(x);
      pixel.y = static_cast<std::int16_t>(y);
      points.push_back({pixel, {0.5F, strong ? 0.01F : 0.0F}});
    }
  }
  ASSERT_GT(with_depth, 50);
  vo_.begin(frame, SE3(), points, nullptr);
  EXPECT_LT(vo_.tracking_reference()->threshold_share, 1.0);
}

/// How many of the newest keyframe's pixels have a slope, once stereo knows the depths of all.
int pixels_with_slope(bool surface_slopes) {
  const SyntheticScene scene(3);
  DirectConfig config = small_config();
  config.points.surface_slopes = surface_slopes;
  WorkerPool pool(1);
  DirectOdometry vo(config, small_camera(), ImageU8(), 0, &pool);
  SE3 pose;
  KeyframeStereo stereo;
  stereo.depths = [&](const std::vector<SelectedPixel>& pixels,
                      std::vector<DepthProposal>* proposals) {
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const double depth = scene.depth(small_camera(), pose, Vec2(pixels[i].x, pixels[i].y));
      (*proposals)[i] = {static_cast<float>(1.0 / depth), static_cast<float>(0.01 / depth)};
    }
  };
  const MonoFrame first = frame_at(scene, pose, 0);
  const std::vector<SelectedPixel> pixels = vo.select_pixels(first, 700);
  std::vector<DepthProposal> depths(pixels.size());
  stereo.depths(pixels, &depths);
  std::vector<StartPoint> points;
  for (std::size_t i = 0; i < pixels.size(); ++i) points.push_back({pixels[i], depths[i]});
  vo.begin(first, pose, points, nullptr);
  for (int i = 1; vo.window().size() < 3 && i < 40; ++i) {
    pose = drive(i);
    vo.map(vo.track(frame_at(scene, pose, i), 0.0), stereo, nullptr);
  }
  EXPECT_EQ(vo.window().size(), 3);
  const std::vector<ImmaturePoint>& newest = vo.window().newest().immature;
  EXPECT_GT(newest.size(), 100U);
  return static_cast<int>(std::count_if(newest.begin(), newest.end(), [](const ImmaturePoint& p) {
    return p.slope.u != 0.0F || p.slope.v != 0.0F;
  }));
}

TEST(NewKeyframe, ItsPixelsLearnTheSlopeOfWhatTheyLieOnWhereWanted) {
  EXPECT_GT(pixels_with_slope(true), 100);
  EXPECT_EQ(pixels_with_slope(false), 0);
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

}  // namespace
}  // namespace sovo
