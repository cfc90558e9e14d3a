#include "sovo/vo/view_forecast.h"

#include <gtest/gtest.h>

#include <algorithm>

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

/// The plane, and what its upper half shows is a thousand times as far.
Window window_below_clouds() {
  Window window = plane_window(SE3(SO3(), Vec3(0, 0, -0.1)));
  for (Point& p : window[0].points) p.rho *= p.v < 64.0F ? 1e-3 : 1.0;
  return window;
}

/// `above` pixels of the upper half and `below` of the lower one, mixed.
std::vector<SelectedPixel> pixels_of(int above, int below) {
  std::vector<SelectedPixel> out;
  for (int i = 0; i < std::max(above, below); ++i) {
    const auto x = static_cast<std::int16_t>(20 + i % 160);
    if (i < above) out.push_back({x, 20, 1, 0.0F});
    if (i < below) out.push_back({x, 120, 1, 0.0F});
  }
  return out;
}

int far_ones(const std::vector<SelectedPixel>& pixels) {
  return static_cast<int>(std::ranges::count(pixels, 20, &SelectedPixel::y));
}

TEST(ViewForecast, FewOfTheFarPixelsAreKeptWhereThereAreNearOnes) {
  const ViewForecast forecast(window_below_clouds());
  EXPECT_TRUE(forecast.is_far(100, 20));
  EXPECT_FALSE(forecast.is_far(100, 120));

  std::vector<SelectedPixel> pixels = pixels_of(200, 100);
  // A quarter of the forty that are wanted; so, of 300, 110 are of use, which is too little to ask
  // for even more.
  EXPECT_DOUBLE_EQ(forecast.keep_lasting(40, &pixels), ViewForecast::kLeastShare);
  EXPECT_EQ(pixels.size(), 40U);
  EXPECT_EQ(far_ones(pixels), 10);
  EXPECT_EQ(far_ones({pixels.begin(), pixels.begin() + 30}), 0) << "near ones come first";
  std::ranges::sort(pixels, {}, &SelectedPixel::x);
  EXPECT_LT(pixels[5].x, 60) << "evenly taken";
  EXPECT_GT(pixels[35].x, 90);

  // Where near ones are wanting, far ones fill their places.
  pixels = pixels_of(200, 30);
  forecast.keep_lasting(100, &pixels);
  EXPECT_EQ(pixels.size(), 100U);
  EXPECT_EQ(far_ones(pixels), 70);

  // Few far ones are taken as all others are, in their order.
  pixels = pixels_of(9, 90);
  EXPECT_DOUBLE_EQ(forecast.keep_lasting(66, &pixels), 1.0);
  EXPECT_EQ(pixels.size(), 66U);
  EXPECT_EQ(far_ones(pixels), 6) << "two of three, as of all";
  EXPECT_TRUE(std::ranges::is_sorted(pixels, {}, &SelectedPixel::x));
}

TEST(ViewForecast, IsFarWhereEverythingIs) {
  Window window = window_below_clouds();
  window[1].points.push_back(make_point(window[1].image(), 101, 21, 1.0 / kDepth));
  EXPECT_FALSE(ViewForecast(window).is_far(100, 20)) << "something near is seen there, too";
  EXPECT_TRUE(ViewForecast(window).is_far(164, 20));

  // Of a plane nothing is far, however far it is; nor where nothing is known.
  Window plane = plane_window(SE3(SO3(), Vec3(0, 0, -0.1)));
  for (Point& p : plane[0].points) p.rho = 1e-4;
  EXPECT_FALSE(ViewForecast(plane).is_far(100, 20));
  plane[0].points.clear();
  EXPECT_FALSE(ViewForecast(plane).is_far(100, 20));
}

}  // namespace
}  // namespace sovo
