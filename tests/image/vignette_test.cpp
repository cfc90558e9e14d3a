#include "sovo/image/vignette.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/cameras.h"

namespace sovo {
namespace {

TEST(OffAxis, IsZeroOnTheAxisAndOneInTheFarthestCorner) {
  const CameraModel camera = test::make_camera(640, 400, 450, 440, 322, 197);
  const OffAxis off_axis(camera);
  EXPECT_DOUBLE_EQ(off_axis.of(0.0, 0.0), 0.0);
  const double x = -322.0 / 450.0;  // the left lower corner is the farthest
  const double y = (399.0 - 197.0) / 440.0;
  EXPECT_NEAR(off_axis.of(x, y), 1.0, 1e-12);
  EXPECT_DOUBLE_EQ(off_axis.of(3.0, 4.0), 1.0) << "beyond it";
  const double farthest = (x * x + y * y) / (1.0 + x * x + y * y);
  EXPECT_NEAR(off_axis.of(0.3, 0.4), 0.25 / 1.25 / farthest, 1e-12);
}

TEST(OffAxis, OfADistortedCamerasPixelsIsThatOfWhatTheySee) {
  const CameraModel pinhole = test::make_camera(640, 400, 450, 440, 322, 197);
  CameraModel distorted = pinhole;
  distorted.distortion = Distortion::kRadtan;
  distorted.d = {-0.28, 0.07, 1e-4, 2e-5};
  distorted.num_coefficients = 4;
  const OffAxis off_axis(pinhole);
  const ImageF map = off_axis.of(distorted);
  ASSERT_EQ(map.width(), 640);
  ASSERT_EQ(map.height(), 400);
  for (const Vec3& ray : {Vec3(0, 0, 1), Vec3(0.3, -0.2, 1), Vec3(-0.4, 0.3, 1)}) {
    const Vec2 pixel = *distorted.project(ray);
    const int u = static_cast<int>(std::lround(pixel.x()));
    const int v = static_cast<int>(std::lround(pixel.y()));
    EXPECT_NEAR(map.at(u, v), off_axis.of(ray.x(), ray.y()), 4e-3) << ray.transpose();
  }
}

TEST(RadialVignette, FallsFromOneAsItsTermsSay) {
  RadialVignette vignette;
  EXPECT_FALSE(vignette.any());
  vignette.terms = {-0.1, -0.2, -0.3};
  EXPECT_TRUE(vignette.any());
  EXPECT_DOUBLE_EQ(vignette.log_at(0.0), 0.0);
  EXPECT_NEAR(vignette.log_at(0.5), -0.05 - 0.05 - 0.0375, 1e-12);
  EXPECT_NEAR(vignette.log_at(1.0), -0.6, 1e-12);
}

TEST(VignetteCorrection, GivesBothImagesBackTheirLight) {
  const CameraModel left = test::make_camera(320, 200, 225, 225, 160, 100);
  const CameraModel right = test::make_camera(300, 220, 210, 215, 151, 108);
  const OffAxis off_axis(left);
  const RadialVignette vignette{{-0.3, 0.0, -0.4}};
  VignetteCorrection correction;
  correction.set(vignette, off_axis.of(left), off_axis.of(right));
  EXPECT_EQ(correction.vignette(), vignette);
  const auto expect_even = [&](const CameraModel& camera, const auto& apply) {
    ImageF image(camera.width, camera.height);
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const double s = off_axis.of((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy);
        image.at(x, y) = static_cast<float>(120.0 * std::exp(vignette.log_at(s)));
      }
    }
    apply(&image);
    for (std::size_t i = 0; i < image.size(); ++i) ASSERT_NEAR(image.data()[i], 120.0, 2e-3) << i;
  };
  expect_even(left, [&](ImageF* image) { correction.apply_left(image); });
  expect_even(right, [&](ImageF* image) { correction.apply_right(image); });
}

}  // namespace
}  // namespace sovo
