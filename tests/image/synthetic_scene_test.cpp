#include "support/synthetic_scene.h"

#include <gtest/gtest.h>

namespace sovo {
namespace {

CameraModel small_camera() {
  CameraModel camera;
  camera.width = 160;
  camera.height = 120;
  camera.fx = camera.fy = 100.0;
  camera.cx = 79.5;
  camera.cy = 59.5;
  return camera;
}

TEST(SyntheticScene, DepthVariesAndIsThatOfTheSurface) {
  const test::SyntheticScene scene(1);
  const CameraModel camera = small_camera();
  ImageF depth;
  const ImageF image = scene.render(camera, SE3(), &depth);
  const auto [low, high] = std::minmax_element(depth.data(), depth.data() + depth.size());
  EXPECT_GT(*low, 1.2F);
  EXPECT_LT(*low, 2.5F);
  EXPECT_GT(*high, 5.0F);
  EXPECT_LT(*high, 8.5F);

  // The surface point that one camera sees has the same grey level in another one.
  const SE3 T_world_other(SO3::exp(Vec3(0.02, -0.05, 0.01)), Vec3(0.1, -0.05, 0.1));
  const Vec2 pixel(20.0, 15.0);
  const Vec3 p =
      *camera.unproject(pixel) / camera.unproject(pixel)->z() * scene.depth(camera, SE3(), pixel);
  const Vec3 from = T_world_other.translation();
  const auto hit = scene.cast(from, (p - from).normalized());
  EXPECT_NEAR(hit.distance, (p - from).norm(), 1e-9);
  EXPECT_NEAR(hit.value, static_cast<double>(image.at(20, 15)), 1e-3);
}

TEST(SyntheticScene, TextureHasEnergyAtEveryScale) {
  const test::SyntheticScene scene(2);
  ImageF image = scene.render(small_camera(), SE3());
  for (int factor = 1; factor <= 8; factor *= 2) {
    double energy = 0.0;
    int count = 0;
    for (int y = factor; y < image.height() - factor; y += factor) {
      for (int x = factor; x < image.width() - factor; x += factor) {
        const double step = static_cast<double>(image.at(x, y) - image.at(x - factor, y));
        energy += step * step;
        ++count;
      }
    }
    EXPECT_GT(std::sqrt(energy / count), 4.0) << "step of " << factor << " px";
  }
}

}  // namespace
}  // namespace sovo
