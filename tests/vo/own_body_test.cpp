#include <gtest/gtest.h>

#include "sovo/vo/direct_odometry.h"
#include "vo/drive_test_support.h"

namespace sovo {
namespace {

using namespace test;

/// A body of strong texture, 0.4 m away, over the lower part of the image.
constexpr int kBodyEdge = 112;
constexpr float kBodyRho = 2.5F;

DirectConfig body_config() {
  DirectConfig config;
  config.points.active_points = 500;
  config.points.immature_points = 400;
  return config;
}

/// A vehicle that sees its own body before a room.
class Vehicle {
 public:
  /// `contrast`: of the world, as a share of what it mostly is.
  explicit Vehicle(int body_edge = kBodyEdge, float contrast = 1.0F)
      : body_edge_(body_edge),
        contrast_(contrast),
        pool_(1),
        vo_(body_config(), small_camera(), ImageU8(), 0, &pool_) {
    const MonoFrame first = seen_from(SE3(), 0);
    std::vector<StartPoint> points;
    for (const SelectedPixel& pixel : vo_.select_pixels(first, 700)) {
      points.push_back({pixel, depth_of(pixel, SE3())});
      if (pixel.sparse) sparse_.push_back(pixel);
    }
    vo_.begin(first, SE3(), points, nullptr);
  }

  /// The next frame, from where the vehicle has come.
  TrackedFrame track(const SE3& T_world_camera) {
    pose_ = T_world_camera;
    return vo_.track(seen_from(pose_, ++frame_), 0.0);
  }
  MapResult map(const TrackedFrame& tracked) {
    KeyframeStereo stereo;
    stereo.depths = [this](const auto& pixels, std::vector<DepthProposal>* proposals) {
      for (std::size_t i = 0; i < pixels.size(); ++i) {
        (*proposals)[i] = depth_of(pixels[i], pose_);
      }
    };
    return vo_.map(tracked, stereo, nullptr);
  }

  DirectOdometry& odometry() { return vo_; }
  /// How many of the sparse pixels that the map began with have a point in the first keyframe.
  std::size_t sparse_points() {
    const Keyframe& first = vo_.window()[0];
    return static_cast<std::size_t>(std::ranges::count_if(sparse_, [&](const SelectedPixel& s) {
      const auto is_there = [&](const auto& p) {
        return p.u == static_cast<float>(s.x) && p.v == static_cast<float>(s.y);
      };
      return std::ranges::any_of(first.points, is_there) ||
             std::ranges::any_of(first.immature, is_there);
    }));
  }
  MonoFrame seen_from(const SE3& T_world_camera, int index) const {
    MonoFrame frame = frame_at(scene_, T_world_camera, index);
    ImageF image = frame.pyramid->level(0);
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) {
        if (y < body_edge_) {
          image.at(x, y) = 128.0F + contrast_ * (image.at(x, y) - 128.0F);
          continue;
        }
        image.at(x, y) =
            static_cast<float>(110.0 + 40.0 * std::sin(0.5 * x) * std::cos(0.45 * y + 0.1 * x));
      }
    }
    frame.pyramid = pyramid_of(std::move(image));
    return frame;
  }

 private:
  DepthProposal depth_of(const SelectedPixel& pixel, const SE3& pose) const {
    const Vec2 place(pixel.x, pixel.y);
    const auto rho = pixel.y >= body_edge_
                         ? kBodyRho
                         : static_cast<float>(1.0 / scene_.depth(small_camera(), pose, place));
    return {rho, 0.02F * rho};
  }

  SyntheticScene scene_{3};
  int body_edge_;
  float contrast_;
  std::vector<SelectedPixel> sparse_;
  WorkerPool pool_;
  DirectOdometry vo_;
  SE3 pose_;
  int frame_ = 0;
};

TEST(OwnBodyInView, IsNothingButTheBodyAndIsLeftOut) {
  Vehicle vehicle;
  DirectOdometry& vo = vehicle.odometry();
  EXPECT_TRUE(vo.co_moving_mask().empty());
  MapResult result;
  for (int i = 1; i <= 75; ++i) {
    const TrackedFrame tracked = vehicle.track(drive(i));
    ASSERT_TRUE(tracked.tracking.good) << i;
    result = vehicle.map(tracked);
  }
  const ImageU8 mask = vo.co_moving_mask();
  ASSERT_EQ(mask.height(), small_camera().height);
  int body = 0;
  int world = 0;
  for (int y = 0; y < mask.height(); ++y) {
    for (int x = 0; x < mask.width(); ++x) {
      (y < kBodyEdge ? world : body) += mask.at(x, y) == 0 ? 1 : 0;
    }
  }
  EXPECT_GT(body, 0.5 * mask.width() * (mask.height() - kBodyEdge));
  EXPECT_LT(world, 0.03 * mask.width() * kBodyEdge);

  const auto left_out = [&](float u, float v) {
    return mask.at(static_cast<int>(u), static_cast<int>(v)) == 0;
  };
  for (int h = 0; h < vo.window().size(); ++h) {
    for (const Point& p : vo.window()[h].points) EXPECT_FALSE(left_out(p.u, p.v));
    for (const ImmaturePoint& p : vo.window()[h].immature) EXPECT_FALSE(left_out(p.u, p.v));
  }
  const ReferenceLevel& level = vo.tracking_reference()->levels[0];
  for (std::size_t i = 0; i < level.size(); ++i) EXPECT_FALSE(left_out(level.u[i], level.v[i]));
  for (const SelectedPixel& p : vo.select_pixels(vehicle.seen_from(drive(61), 61), 300)) {
    EXPECT_FALSE(left_out(p.x, p.y));
  }
}

TEST(OwnBodyInView, InAsMuchOfTheImageAsTheWorldDoesNotHoldTheCameraBack) {
  // A way between both, half of the true one, fits nearly all pixels.
  for (const int edge : {80, 90}) {
    for (const int speed : {1, 2, 4}) {
      Vehicle vehicle(edge);
      bool found = false;
      for (int i = 1; i <= 12; ++i) {
        const SE3 truth = drive(speed * i);
        const TrackedFrame tracked = vehicle.track(truth);
        ASSERT_TRUE(tracked.tracking.good) << edge << ' ' << speed << ' ' << i;
        found = found || tracked.views != nullptr;
        EXPECT_FALSE(found && tracked.tracking.motion_denied);
        if (i >= 3) {
          const double off = (tracked.T_world_camera.translation() - truth.translation()).norm();
          EXPECT_LT(off, 0.025) << edge << ' ' << speed << ' ' << i;
        }
        vehicle.map(tracked);
      }
      EXPECT_TRUE(found);
    }
  }
}

TEST(OwnBodyInView, AloneDoesNotMakeACameraRest) {
  WorkerPool pool(1);
  for (const bool moves : {false, true}) {
    const Vehicle vehicle;
    DirectOdometry vo(body_config(), small_camera(), ImageU8(), 0, &pool);
    const MonoFrame first = vehicle.seen_from(SE3(), 0);
    std::vector<StartPoint> points;
    for (const SelectedPixel& pixel : vo.select_pixels(first, 700)) {
      if (pixel.y >= kBodyEdge) points.push_back({pixel, {kBodyRho, 0.02F * kBodyRho}});
    }
    vo.begin(first, SE3(), points, nullptr);
    for (int i = 1; i <= 12; ++i) {
      const TrackedFrame tracked = vo.track(vehicle.seen_from(moves ? drive(i) : SE3(), i), 0.0);
      ASSERT_TRUE(tracked.tracking.good) << i;
      ASSERT_LT(tracked.T_world_camera.translation().norm(), 0.001) << "it fits the body";
      // At first little has moved.
      if (i >= 4) {
        EXPECT_EQ(tracked.tracking.rest_denied, moves) << i;
      }
    }
  }
}

/// Of a weakly textured world little is seen but the body, and standing still fits most points.
TEST(OwnBodyInView, ItIsLeftOutFromAMapsSecondFrameOnWhereTheWorldIsWeak) {
  for (const float contrast : {0.05F, 0.08F}) {
    for (const int speed : {2, 3}) {
      Vehicle vehicle(100, contrast);
      EXPECT_GT(vehicle.sparse_points(), 100U);
      const auto points = [&] { return vehicle.odometry().window()[0].points.size(); };
      const std::size_t before = points();
      for (int i = 1; i <= 8; ++i) {
        const SE3 truth = drive(speed * i);
        const TrackedFrame tracked = vehicle.track(truth);
        ASSERT_TRUE(tracked.tracking.good) << contrast << ' ' << speed << ' ' << i;
        EXPECT_EQ(tracked.views != nullptr, i == 1) << contrast << ' ' << speed << ' ' << i;
        const double off = (tracked.T_world_camera.translation() - truth.translation()).norm();
        EXPECT_LT(off, 0.04) << contrast << ' ' << speed << ' ' << i;
        vehicle.map(tracked);
        if (i == 1) {
          EXPECT_LT(points(), before) << "those of the body are no more";
          EXPECT_GT(vehicle.sparse_points(), 100U);
        }
      }
    }
  }
}

/// Where the world has most of the texture its motion fits, and the body is so many outliers.
TEST(OwnBodyInView, ARightMotionOfAMapsSecondFrameShowsIt) {
  for (const int speed : {2, 3, 4}) {
    Vehicle vehicle;
    const SE3 truth = drive(speed);
    const TrackedFrame tracked = vehicle.track(truth);
    ASSERT_TRUE(tracked.tracking.good) << speed;
    EXPECT_LT((tracked.T_world_camera.translation() - truth.translation()).norm(), 0.01) << speed;
    EXPECT_NE(tracked.views, nullptr) << speed;
    EXPECT_FALSE(tracked.tracking.motion_denied) << speed;
    vehicle.map(tracked);
    EXPECT_FALSE(vehicle.odometry().co_moving_mask().empty()) << speed;
  }
}

TEST(OwnBodyInView, AMapDoesWithoutSparsePointsWhereNothingSpeaksAgainstStanding) {
  Vehicle vehicle(100, 0.05F);
  ASSERT_GT(vehicle.sparse_points(), 100U);
  const Keyframe& first = vehicle.odometry().window()[0];
  const std::size_t others = first.points.size() + first.immature.size() - vehicle.sparse_points();
  const TrackedFrame tracked = vehicle.track(SE3());
  ASSERT_TRUE(tracked.tracking.good);
  EXPECT_EQ(tracked.views, nullptr);
  vehicle.map(tracked);
  EXPECT_EQ(vehicle.sparse_points(), 0U);
  EXPECT_EQ(first.points.size() + first.immature.size(), others);
  EXPECT_EQ(vehicle.odometry().tracking_reference()->levels[0].size(), first.points.size());
}

TEST(OwnBodyInView, WhatItHidesIsOutOfViewThere) {
  Vehicle vehicle;
  DirectOdometry& vo = vehicle.odometry();
  int hidden = 0;
  for (int i = 1; i <= 60; ++i) {
    // It climbs: what lies before it sinks behind the body.
    SE3 pose = drive(i);
    pose.translation().y() = -0.02 * i;
    if (!vehicle.map(vehicle.track(pose)).is_keyframe) continue;
    const ImageU8 mask = vo.co_moving_mask();
    if (mask.empty()) continue;
    for (int h = 0; h + 1 < vo.window().size(); ++h) {
      const PairGeometry& pair = vo.window().pair(h, vo.window().size() - 1);
      for (const Point& p : vo.window()[h].points) {
        const Eigen::Vector3f at =
            pair.KRKi * Eigen::Vector3f(p.u, p.v, 1.0F) + static_cast<float>(p.rho) * pair.Kt;
        const Vec2 place = at.hnormalized().cast<double>();
        if (!small_camera().contains(place)) continue;
        const auto x = static_cast<int>(place.x());
        const auto y = static_cast<int>(place.y());
        hidden += y > kBodyEdge + 2 && mask.at(x, y) == 0 ? 1 : 0;
      }
    }
  }
  EXPECT_FALSE(vo.co_moving_mask().empty());
  // What is out of view in the newest keyframe leaves the window.
  EXPECT_LE(hidden, 5) << "moved there by bundle adjustment";
}

}  // namespace
}  // namespace sovo
