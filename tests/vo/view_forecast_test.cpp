#include "sovo/vo/view_forecast.h"

#include <gtest/gtest.h>

#include "vo/window_test_support.h"

namespace sovo {
namespace {

using namespace test;

constexpr double kDepth = 4.0;

/// A window of two keyframes before a plane at `kDepth`, `T_second_first` apart, whose points the
/// first one hosts.
Window plane_window(const SE3& T_second_first, int stride = 12) {
  const CameraModel camera = small_camera();
  Window window(camera);
  const ImagePyramidPtr image = pyramid_of(WaveImage().sampled(camera.width, camera.height));
  for (std::uint32_t i = 0; i < 2; ++i) {
    const SE3 T_world_camera = i == 0 ? SE3() : T_second_first.inverse();
    Keyframe& k = window.insert(make_keyframe(i, image, T_world_camera));
    for (int v = 6; i == 0 && v < camera.height - 6; v += stride) {
      for (int u = 6; u < camera.width - 6; u += stride) {
        k.points.push_back(make_point(image->level(0), u, v, 1.0 / kDepth));
      }
    }
  }
  window.update_geometry();
  return window;
}

TEST(ViewForecast, IsTrueOfACameraThatGoesOnAsItCame) {
  for (const SE3& step :
       {SE3(SO3(), Vec3(0, 0, -0.8)), SE3(SO3::exp(Vec3(0, 0.15, 0)), Vec3(0, 0, -0.1)),
        SE3(SO3(), Vec3(0.6, -0.2, 0)), SE3(SO3(), Vec3(0, 0, 0.7))}) {
    const ViewForecast forecast(plane_window(step));
    const CameraModel camera = small_camera();
    // What the second keyframe sees, and is on the plane.
    const SE3 T_second_first = step;
    const Vec3 normal = T_second_first.rotation() * Vec3::UnitZ();
    const double distance = kDepth + normal.dot(T_second_first.translation());
    int lost = 0;
    int wrong = 0;
    for (int y = 4; y < camera.height - 4; y += 5) {
      for (int x = 4; x < camera.width - 4; x += 5) {
        const Vec3 ray = *camera.unproject(Vec2(x, y));
        const Vec3 seen = ray * (distance / normal.dot(ray));
        const Vec3 next = T_second_first * seen;
        const auto at = camera.project(next);
        const double edge = !at ? -1e3
                                : std::min({at->x(), at->y(), camera.width - 1 - at->x(),
                                            camera.height - 1 - at->y()});
        lost += edge < 2.0 ? 1 : 0;
        // The plane's depth changes a little within a cell.
        if (edge > 8.0 && !forecast.stays(x, y)) ++wrong;
        const bool known = T_second_first.translation().norm() > 0.0;
        if (edge < -6.0 && known && forecast.stays(x, y)) ++wrong;
      }
    }
    const bool leaves = step.translation().z() <= 0.0;
    EXPECT_EQ(lost > 50, leaves);
    EXPECT_LE(wrong, lost / 10) << "of " << lost;
  }
}

TEST(ViewForecast, NothingIsGivenUpWhereNoDepthOrMotionIsKnown) {
  Window alone(small_camera());
  const ImagePyramidPtr image = pyramid_of(WaveImage().sampled(208, 156));
  alone.insert(make_keyframe(0, image, SE3()));
  alone.update_geometry();
  EXPECT_TRUE(ViewForecast(alone).stays(5, 5));
  Window window = plane_window(SE3(SO3(), Vec3(0, 0, -3.0)));
  EXPECT_FALSE(ViewForecast(window).stays(5, 5));
  window[0].points.clear();
  EXPECT_TRUE(ViewForecast(window).stays(5, 5));
}

TEST(ViewForecast, TheFarthestOfACellDecides) {
  Window window = plane_window(SE3(SO3(), Vec3(0, 0, -2.0)));
  ASSERT_FALSE(ViewForecast(window).stays(20, 20));
  // Seen from the second keyframe at its own pixel (16, 16): far beyond the plane.
  window[1].points.push_back(make_point(window[1].image(), 16, 16, 1.0 / 400.0));
  EXPECT_TRUE(ViewForecast(window).stays(20, 20));
}

TEST(ViewForecast, KeepsAsManyAsAreWantedEvenly) {
  const ViewForecast forecast(plane_window(SE3(SO3(), Vec3(0, 0, -0.8))));
  std::vector<SelectedPixel> pixels;
  for (int i = 0; i < 100; ++i) {
    SelectedPixel p;
    p.x = static_cast<std::int16_t>(90 + i % 20);
    p.y = static_cast<std::int16_t>(70 + i / 20);
    pixels.push_back(p);
    if (i % 4 == 0) pixels.push_back({4, 4, 1, 0.0F});  // leaves the view
  }
  std::vector<SelectedPixel> all = pixels;
  EXPECT_DOUBLE_EQ(forecast.keep_lasting(500, &all), 0.8);
  EXPECT_EQ(all.size(), 100U);
  EXPECT_DOUBLE_EQ(forecast.keep_lasting(40, &pixels), 0.8);
  ASSERT_EQ(pixels.size(), 40U);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const auto row = static_cast<std::size_t>(pixels[i].y - 70);
    EXPECT_EQ(row, i / 8) << "eight of each row of twenty";
  }
  // Of 20 pixels 19 leave the view: that is not believed.
  std::vector<SelectedPixel> corner(19, {4, 4, 1, 0.0F});
  corner.push_back({100, 80, 1, 0.0F});
  EXPECT_DOUBLE_EQ(forecast.keep_lasting(40, &corner), 1.0);
  EXPECT_EQ(corner.size(), 20U);
  std::vector<SelectedPixel> none;
  EXPECT_DOUBLE_EQ(forecast.keep_lasting(40, &none), 1.0);
}

}  // namespace
}  // namespace sovo
