#include "sovo/app/depth_scale.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/cameras.h"

namespace sovo::app {
namespace {

/// A pool seen through lenses that bend, and an undistorted camera with another focal length.
class DepthScale : public ::testing::Test {
 protected:
  DepthScale() : tracked_(test::make_camera(150, 100, 80.0, 80.0, 74.0, 50.0)) {
    sim::SimConfig config;
    config.world = sim::World::kPool;
    config.frames = 2;
    Calibration calibration;
    calibration.rig.left = test::make_camera(160, 112, 95.0, 95.0, 79.0, 56.0, Distortion::kRadtan,
                                             {-0.28, 0.07, 2e-4, 2e-5});
    calibration.rig.right = calibration.rig.left;
    calibration.rig.T_right_left = SE3(SO3(), Vec3(-0.12, 0.0, 0.0));
    source_.emplace(config, calibration, sim::own_motion(config.world));
    truth_ = source_->depth_at(source_->truth().front().stamp_ns);
  }

  /// A keyframe of the first pair whose depths are `factor` times the true ones.
  KeyframeOutput keyframe(double factor, std::size_t points) const {
    const CameraModel& raw = source_->calibration().rig.left;
    KeyframeOutput k;
    k.stamp_ns = source_->truth().front().stamp_ns;
    for (int y = 20; y < 92 && k.u.size() < points; y += 8) {
      for (int x = 20; x < 140 && k.u.size() < points; x += 8) {
        const auto pixel = tracked_.project(*raw.unproject(Vec2(x, y)));
        k.u.push_back(static_cast<float>(pixel->x()));
        k.v.push_back(static_cast<float>(pixel->y()));
        k.inverse_depth.push_back(static_cast<float>(1.0 / (factor * truth_.at(x, y))));
      }
    }
    return k;
  }

  CameraModel tracked_;
  std::optional<sim::SimSource> source_;
  ImageF truth_;
};

TEST_F(DepthScale, IsWhatLengthsAreToBeMultipliedWith) {
  for (const double factor : {0.9, 1.0, 1.03}) {
    const auto scale = depth_log_scale(keyframe(factor, 1000), tracked_, &*source_);
    ASSERT_TRUE(scale.has_value());
    EXPECT_NEAR(*scale, -std::log(factor), 1e-3);
  }
}

TEST_F(DepthScale, AFewWrongDepthsDoNotMatter) {
  KeyframeOutput k = keyframe(1.0, 1000);
  for (std::size_t i = 0; i < k.u.size() / 4; ++i) k.inverse_depth[i] *= 3.0F;
  k.inverse_depth.back() = -1.0F;
  EXPECT_NEAR(*depth_log_scale(k, tracked_, &*source_), 0.0, 3e-3);
}

TEST_F(DepthScale, TooFewPointsTellNothing) {
  EXPECT_TRUE(depth_log_scale(keyframe(1.0, 40), tracked_, &*source_).has_value());
  EXPECT_FALSE(depth_log_scale(keyframe(1.0, 20), tracked_, &*source_).has_value());
}

}  // namespace
}  // namespace sovo::app
