#include "sovo/geometry/camera_model.h"

#include <gtest/gtest.h>

#include <vector>

#include "support/cameras.h"
#include "support/numeric.h"

namespace sovo {
namespace {

/// One camera of every kind, with lenses as strong as real ones.
std::vector<CameraModel> cameras() {
  CameraModel five = test::make_camera(
      640, 480, 535.4, 539.2, 320.1, 247.6, Distortion::kRadtan,
      {0.262383, -0.953104, -0.005358, 0.002628, 1.163314});  // TUM RGB-D freiburg1's lens
  CameraModel eight = test::make_camera(
      1280, 720, 610.0, 612.0, 645.0, 357.0, Distortion::kRadtan,
      {0.62, -2.7, 0.0006, -0.0003, 1.55, 0.49, -2.52, 1.48});  // Azure-Kinect-like
  return {test::make_camera(1226, 370, 707.0912, 707.0912, 601.8873, 183.1104),
          test::euroc_left(),
          five,
          eight,
          test::tumvi_left(),
          test::tumvi_right()};
}

std::string label(const CameraModel& camera) {
  return to_string(camera.distortion) + " " + std::to_string(camera.num_coefficients);
}

TEST(CameraModel, UnprojectInvertsProjectOverTheImage) {
  for (const CameraModel& camera : cameras()) {
    int rays = 0;
    int pixels = 0;
    for (int y = 0; y < camera.height; y += 7) {
      for (int x = 0; x < camera.width; x += 7) {
        ++pixels;
        const Vec2 pixel(x, y);
        const auto ray = camera.unproject(pixel);
        if (!ray) continue;
        ++rays;
        ASSERT_NEAR(ray->norm(), 1.0, 1e-12) << label(camera);
        for (const double distance : {0.1, 30.0}) {
          const auto back = camera.project(distance * *ray);
          ASSERT_TRUE(back) << label(camera) << " at " << pixel.transpose();
          ASSERT_LT((*back - pixel).norm(), 1e-6) << label(camera) << " at " << pixel.transpose();
        }
      }
    }
    // A fisheye's lens fills a circle; the polynomial folds in the corners beyond it.
    const double share = camera.distortion == Distortion::kEquidistant ? 0.96 : 0.9999;
    EXPECT_GT(rays, share * pixels) << label(camera);
  }
}

TEST(CameraModel, JacobianOfProjectionAgainstCentralDifferences) {
  for (const CameraModel& camera : cameras()) {
    for (int y = 5; y < camera.height; y += 60) {
      for (int x = 5; x < camera.width; x += 60) {
        const auto ray = camera.unproject(Vec2(x, y));
        if (!ray) continue;
        const Vec3 point = 2.5 * *ray;
        Mat23 jacobian;
        ASSERT_TRUE(camera.project(point, &jacobian));
        const Mat23 numeric = test::central_differences<2, 3>(
            [&](const Vec3& p) { return *camera.project(p); }, point);
        ASSERT_LT(test::relative_difference(jacobian, numeric), 1e-6)
            << label(camera) << " at " << x << ", " << y;
      }
    }
  }
}

TEST(CameraModel, JacobianOnTheOpticalAxisOfAFisheye) {
  const CameraModel camera = test::tumvi_left();
  const Vec3 axis(0.0, 0.0, 2.0);
  Mat23 jacobian;
  const auto pixel = camera.project(axis, &jacobian);
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x(), camera.cx, 1e-12);
  const Mat23 numeric =
      test::central_differences<2, 3>([&](const Vec3& p) { return *camera.project(p); }, axis);
  EXPECT_LT(test::relative_difference(jacobian, numeric), 1e-6);
}

TEST(CameraModel, AFisheyeSeesBesideItselfAPinholeDoesNot) {
  const Vec3 beside(1.0, 0.0, -0.05);
  EXPECT_TRUE(test::tumvi_left().project(beside));
  EXPECT_FALSE(test::euroc_left().project(beside));
  EXPECT_FALSE(test::make_camera(64, 48, 50, 50, 32, 24).project(beside));
  EXPECT_FALSE(test::tumvi_left().project(Vec3(0.0, 0.0, -1.0)));
  EXPECT_FALSE(test::euroc_left().project(Vec3(0.0, 0.0, 0.0)));
}

TEST(CameraModel, RefusesPointsPastTheFoldOfTheDistortion) {
  // r (1 - 0.3 r^2) grows up to r = 1.054 only; without a test a point at r = 1.7 would appear
  // near the image centre.
  const CameraModel camera =
      test::make_camera(640, 480, 400, 400, 320, 240, Distortion::kRadtan, {-0.3, 0.0, 0.0, 0.0});
  EXPECT_TRUE(camera.project(Vec3(1.0, 0.0, 1.0)));
  EXPECT_FALSE(camera.project(Vec3(1.1, 0.0, 1.0)));
  EXPECT_FALSE(camera.project(Vec3(1.7, 0.0, 1.0)));
  // A pixel farther out than the fold reaches has no ray.
  EXPECT_FALSE(camera.unproject(Vec2(320.0 + 400.0 * 0.75, 240.0)));

  const CameraModel fisheye = test::make_camera(640, 480, 200, 200, 320, 240,
                                                Distortion::kEquidistant, {-0.2, 0.0, 0.0, 0.0});
  EXPECT_TRUE(fisheye.project(Vec3(std::sin(1.2), 0.0, std::cos(1.2))));
  EXPECT_FALSE(fisheye.project(Vec3(std::sin(1.4), 0.0, std::cos(1.4))));
}

TEST(CameraModel, DownscalingAgreesWithMeansOfBlocks) {
  for (const CameraModel& camera : cameras()) {
    for (const int factor : {2, 3, 8}) {
      const CameraModel small = camera.downscaled(factor);
      EXPECT_EQ(small.width, camera.width / factor);
      EXPECT_EQ(small.height, camera.height / factor);
      // The centre of a block, in the large image, is the mean of its pixel centres.
      const int bx = small.width / 3;
      const int by = small.height / 4;
      const Vec2 center(bx * factor + 0.5 * (factor - 1), by * factor + 0.5 * (factor - 1));
      const auto ray = camera.unproject(center);
      ASSERT_TRUE(ray);
      const auto pixel = small.project(*ray);
      ASSERT_TRUE(pixel);
      EXPECT_LT((*pixel - Vec2(bx, by)).norm(), 1e-8) << label(camera) << " by " << factor;
    }
    const CameraModel level3 = camera.at_level(3);
    EXPECT_NEAR(level3.fx, camera.fx / 8, 1e-12);
    EXPECT_NEAR(level3.cx, camera.downscaled(2).downscaled(2).downscaled(2).cx, 1e-12);
  }
}

TEST(CameraModel, ContainsItsPixelCentres) {
  const CameraModel camera = test::make_camera(64, 48, 50, 50, 32, 24);
  EXPECT_TRUE(camera.contains({0.0, 0.0}));
  EXPECT_TRUE(camera.contains({63.0, 47.0}));
  EXPECT_FALSE(camera.contains({63.01, 47.0}));
  EXPECT_FALSE(camera.contains({-0.01, 3.0}));
  EXPECT_FALSE(camera.contains({1.5, 20.0}, 2.0));
}

TEST(StereoRig, BaselineAndBodyFrame) {
  StereoRig rig;
  rig.T_right_left = SE3(SO3::exp(Vec3(0.01, 0.02, -0.3)), Vec3(-0.3, 0.4, 0.0));
  EXPECT_NEAR(rig.baseline(), 0.5, 1e-12);
  // Optical z (forward) is x of the body, optical x (right) is its -y, optical y (down) its -z.
  EXPECT_LT((rig.T_base_left * Vec3(1.0, 2.0, 3.0) - Vec3(3.0, -1.0, -2.0)).norm(), 1e-12);
}

}  // namespace
}  // namespace sovo
