#include "sovo/geometry/lens_change.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/cameras.h"

namespace sovo {
namespace {

CameraModel fisheye() {
  CameraModel camera = test::make_camera(640, 400, 300, 301, 321.5, 200.5);
  camera.distortion = Distortion::kEquidistant;
  camera.num_coefficients = 4;
  camera.d = {-0.012, 0.004, -0.003, 0.0006};
  return camera;
}

/// Where a pixel's ray meets the normalized image.
Vec2 met(const CameraModel& camera, const Vec2& pixel) {
  const Vec3 ray = camera.unproject(pixel).value();
  return ray.head<2>() / ray.z();
}

/// Squares of how far rays of `changed` are from those of `camera`, and of what `told` leaves.
struct Misfit {
  double all = 0.0, left = 0.0;
};
Misfit misfit(const CameraModel& camera, const CameraModel& changed, const LensChange& told) {
  Misfit out;
  for (int v = 10; v < camera.height; v += 20) {
    for (int u = 10; u < camera.width; u += 20) {
      const Vec2 x = met(camera, {u, v});
      const Vec2 seen = met(changed, {u, v}) - x;
      out.all += seen.squaredNorm();
      out.left += (seen + x * (told.focal + told.radial * x.squaredNorm())).squaredNorm();
    }
  }
  return out;
}

TEST(ChangedNumbers, AreFocalLengthsAndTheFirstCoefficient) {
  const CameraModel camera = fisheye();
  const CameraModel changed = with_changed_numbers(camera, {std::log(1.02), 0.003});
  EXPECT_NEAR(changed.fx, 306.0, 1e-9);
  EXPECT_NEAR(changed.fy, 1.02 * 301.0, 1e-9);
  EXPECT_EQ(changed.cx, camera.cx);
  EXPECT_NEAR(changed.d[0], -0.009, 1e-12);
  EXPECT_EQ(changed.d[1], camera.d[1]);
  EXPECT_EQ(changed.distortion, Distortion::kEquidistant);
}

TEST(ChangedNumbers, GiveAPinholeADistortionOnlyIfItGetsOne) {
  const CameraModel camera = test::make_camera(640, 400, 300, 301, 321.5, 200.5);
  EXPECT_EQ(with_changed_numbers(camera, {0.01, 0.0}).distortion, Distortion::kNone);
  const CameraModel bent = with_changed_numbers(camera, {0.0, 0.01});
  EXPECT_EQ(bent.distortion, Distortion::kRadtan);
  EXPECT_EQ(bent.num_coefficients, 4);
  EXPECT_EQ(bent.d[0], 0.01);
}

TEST(ChangeOfRays, IsThatOfTheNumbersForAPinhole) {
  const Mat2 change = change_of_rays(test::make_camera(640, 400, 300, 301, 321.5, 200.5));
  EXPECT_LT((change - Mat2::Identity()).norm(), 1e-3) << change;
}

TEST(ChangeOfRays, TellsWhereTheRaysOfOtherLensesGo) {
  CameraModel bent = test::make_camera(752, 480, 458, 457, 367, 248);
  bent.distortion = Distortion::kRadtan;
  bent.num_coefficients = 4;
  bent.d = {-0.28, 0.07, 2e-4, 2e-5};
  CameraModel dived = fisheye();
  dived.port = FlatPort{.distance = 0.02, .thickness = 0.008};
  for (const CameraModel& camera : {fisheye(), bent, dived}) {
    for (const LensChange& numbers : {LensChange{1e-4, 0.0}, LensChange{0.0, 1e-4}}) {
      const CameraModel changed = with_changed_numbers(camera, numbers);
      const LensChange rays = LensChange::of(change_of_rays(camera) * numbers.vector());
      const Misfit told = misfit(camera, changed, rays);
      EXPECT_LT(told.left, 0.01 * told.all);
      EXPECT_LT(told.left, 0.3 * misfit(camera, changed, numbers).left) << "as of a pinhole";
    }
  }
}

}  // namespace
}  // namespace sovo
