#include "sovo/image/vignette.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/cameras.h"
#include "support/same_bits.h"

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

TEST(VignetteCorrection, GivesAnImageBackItsLight) {
  const CameraModel camera = test::make_camera(301, 203, 210, 215, 151, 101);
  const OffAxis off_axis(camera);
  const VignetteCorrection correction(off_axis.of(camera));
  for (const RadialVignette& vignette :
       {RadialVignette{{-0.3, 0.0, -0.4}}, RadialVignette{{-0.5, -0.5, -1.0}}}) {
    ImageF image(camera.width, camera.height);
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const double s = off_axis.of((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy);
        image.at(x, y) = static_cast<float>(120.0 * std::exp(vignette.log_at(s)));
      }
    }
    correction.apply(vignette, &image);
    for (std::size_t i = 0; i < image.size(); ++i) ASSERT_NEAR(image.data()[i], 120.0, 0.01) << i;
  }
}

TEST(SameBits, VignetteDivided) {
  ImageF off_axis(45, 31);
  ImageF image(45, 31);
  for (std::size_t i = 0; i < image.size(); ++i) {
    off_axis.data()[i] = static_cast<float>(i) / static_cast<float>(image.size());
    image.data()[i] = static_cast<float>(i % 256);
  }
  VignetteCorrection(off_axis).apply({{-0.3, -0.1, -0.6}}, &image);
  test::Checksum sum;
  sum.add(image);
  EXPECT_EQ(sum.value(), 8327470636956107584U);
}

}  // namespace
}  // namespace sovo
