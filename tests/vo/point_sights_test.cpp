#include "sovo/vo/point_sights.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "sovo/vo/moving_light.h"
#include "support/cameras.h"
#include "vo/window_test_support.h"

namespace sovo {
namespace {

constexpr double kWay = 1.0;  ///< Ahead, to the second keyframe [m].
constexpr float kHostGrey = 60.0F;

const CameraModel& sights_camera() {
  static const CameraModel camera = test::make_camera(320, 200, 225, 225, 160, 100);
  return camera;
}

/// The ground is near, what stands above it is far [m].
double depth_of_row(int v) { return v > 100 ? 3.0 : 9.0; }

double nearer(double depth) { return depth / (depth - kWay); }

/// Two keyframes: the first hosts a point on each patch of one grey level, which the second shows
/// where it is after the way, as bright as `lamps` (an exponent of nearness) make it.
Window window_of_patches(double lamps) {
  const CameraModel& camera = sights_camera();
  ImageF first(camera.width, camera.height);
  std::fill_n(first.data(), first.size(), kHostGrey);
  ImageF second = first;
  Window window(camera);
  std::vector<Point> points;
  for (int v = 40; v < 170; v += 13) {
    for (int u = 70; u < 260; u += 13) {
      const double near = nearer(depth_of_row(v));
      const auto x = static_cast<int>(std::lround(camera.cx + near * (u - camera.cx)));
      const auto y = static_cast<int>(std::lround(camera.cy + near * (v - camera.cy)));
      for (int j = std::max(0, y - 6); j <= std::min(camera.height - 1, y + 6); ++j) {
        for (int i = std::max(0, x - 6); i <= std::min(camera.width - 1, x + 6); ++i) {
          second.at(i, j) = kHostGrey * static_cast<float>(std::pow(near, lamps));
        }
      }
      points.push_back(test::make_point(first, u, v, 1.0 / depth_of_row(v)));
    }
  }
  window.insert(test::make_keyframe(0, test::pyramid_of(first), SE3()));
  window.insert(test::make_keyframe(1, test::pyramid_of(second), {SO3(), Vec3(0.0, 0.0, kWay)}));
  for (Point& p : points) {
    p.residuals[static_cast<std::size_t>(window[1].slot)].state = ResidualState::kIn;
    window[0].points.push_back(p);
  }
  window.update_geometry();
  return window;
}

TEST(PointSights, ShowWhereAPointIsHowBrightAndHowMuchNearer) {
  const Window window = window_of_patches(1.5);
  const PointSights seen = test::sights_in_newest(window);
  ASSERT_EQ(seen.size(), 1U);
  ASSERT_GT(seen[0].size(), 100U);
  for (const PointSight& s : seen[0]) {
    const double depth = depth_of_row(static_cast<int>(s.v_host));
    EXPECT_NEAR(s.depth_ratio, (depth - kWay) / depth, 1e-5);
    EXPECT_NEAR(s.u, 160.0 + nearer(depth) * (s.u_host - 160.0), 1e-3);
    EXPECT_NEAR(s.v, 100.0 + nearer(depth) * (s.v_host - 100.0), 1e-3);
    EXPECT_NEAR(s.grey_host, 60.0, 1e-3);
    EXPECT_NEAR(s.grey, 60.0 * std::pow(nearer(depth), 1.5), 0.01);
  }
}

TEST(PointSights, AreOfInliersOnly) {
  Window window = window_of_patches(0.0);
  const std::size_t all = test::sights_in_newest(window)[0].size();
  window[0].points[50].residuals[static_cast<std::size_t>(window[1].slot)].state =
      ResidualState::kOutlier;
  EXPECT_EQ(test::sights_in_newest(window)[0].size(), all - 1);
}

TEST(MovingLight, IsFoundInWhatAWindowShows) {
  for (const double lamps : {0.0, 1.5}) {
    const Window window = window_of_patches(lamps);
    MovingLight light{MovingLightConfig()};
    for (int i = 0; i < 6; ++i) light.observe(sights_camera(), test::sights_in_newest(window));
    EXPECT_EQ(light.found(), lamps > 0.0) << lamps;
  }
}

/// Points that come nearer without leaving their pixels tell of nothing but distance, and points
/// that move across the beam at one distance of nothing but the beam.
TEST(MovingLight, DistanceAndBeamCountEachByItself) {
  for (const bool beam : {false, true}) {
    PointSights seen(1);
    for (int i = 0; i < 150; ++i) {
      PointSight s;
      s.u_host = 20.0 + 1.8 * i;
      s.v_host = s.v = 30.0 + (37 * i) % 140;
      s.u = beam ? s.u_host + (i % 2 == 0 ? 25.0 : -25.0) : s.u_host;
      s.depth_ratio = beam ? 1.0 : 0.7 + 0.004 * ((53 * i) % 150);
      const double across =
          ((s.u - 160.0) * (s.u - 160.0) - (s.u_host - 160.0) * (s.u_host - 160.0));
      s.grey_host = 90.0;
      s.grey = 90.0 * std::pow(s.depth_ratio, -1.5) * std::exp(-across / (150.0 * 150.0));
      seen[0].push_back(s);
    }
    MovingLight light{MovingLightConfig()};
    for (int i = 0; i < 6; ++i) light.observe(sights_camera(), seen);
    EXPECT_TRUE(light.found()) << (beam ? "beam" : "distance");
  }
}

}  // namespace
}  // namespace sovo
