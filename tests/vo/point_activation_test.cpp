#include "sovo/vo/point_activation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "vo/window_test_support.h"

namespace sovo {
namespace {

TEST(OccupancyMap, FindsTakenPixelsAsSearchingAllOfThemDoes) {
  constexpr int kWidth = 141;
  constexpr int kHeight = 67;
  std::mt19937 random(2);
  OccupancyMap map(kWidth, kHeight);
  std::vector<std::pair<int, int>> taken;
  const auto pixel = [&] {
    return std::pair(static_cast<int>(random() % kWidth), static_cast<int>(random() % kHeight));
  };
  int near = 0;
  int far = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    if (trial % 50 == 0) {
      taken.push_back(pixel());
      map.take(taken.back().first, taken.back().second);
    }
    const auto place = pixel();
    const int x = place.first;
    const int y = place.second;
    const float distance = 0.1F * static_cast<float>(random() % 170);
    const bool expected = std::any_of(taken.begin(), taken.end(), [&](const auto& other) {
      const int dx = std::abs(x - other.first);
      const int dy = std::abs(y - other.second);
      return static_cast<float>(std::max(dx, dy)) + 0.5F * static_cast<float>(std::min(dx, dy)) <
             distance;
    });
    EXPECT_EQ(map.any_closer(x, y, distance), expected) << x << " " << y << " " << distance;
    ++(expected ? near : far);
  }
  EXPECT_GT(near, 300);
  EXPECT_GT(far, 300);
}

/// `points` of the host, to be looked for where their inverse depth is `factor` times as large.
void add_immature(const std::vector<Point>& points, double factor, Keyframe* host) {
  for (const Point& known : points) {
    ImmaturePoint p;
    if (!make_immature_point(host->image(), known.u, known.v, 1, PointConfig(),
                             WindowConfig().gradient_constant, &p)) {
      continue;
    }
    p.rho_min = p.rho_max = static_cast<float>(factor * known.rho);
    p.interval_px = 1.0F;
    p.state = TraceState::kGood;
    host->immature.push_back(p);
  }
}

int activate(Window* window) {
  window->update_geometry();
  WorkerPool pool(1);
  return PointActivator(PointConfig(), WindowConfig(), &pool).activate(window);
}

/// Immature points of the first of four keyframes at their true depths. `forward`: the last ones
/// stand so far ahead of the host, 0: near it. `deny`: they see another world where these points
/// are, as they see a car's place when it has driven on.
int activated(int last_ones, double forward = 0.0, bool deny = true) {
  using namespace test;
  const SyntheticScene scene(3);
  const SyntheticScene elsewhere(11);
  const CameraModel camera = small_camera();
  Window window(camera);
  std::vector<SE3> poses;
  const auto is_last = [last_ones](int i) { return i >= 4 - last_ones; };
  for (int i = 0; i < 4; ++i) {
    const bool approached = forward > 0.0 && is_last(i);
    poses.push_back(approached ? SE3(SO3(), Vec3(0, 0, forward)) : keyframe_pose(i));
  }
  for (int i = 0; i < 4; ++i) {
    const bool other = deny && is_last(i);
    const auto at = poses[static_cast<std::size_t>(i)];
    window.insert(make_keyframe(static_cast<std::uint32_t>(i),
                                scene_view(other ? elsewhere : scene, camera, at), at));
  }
  add_immature(scene_points(scene, camera, window[0].image(), poses, 0, 9), 1.0, &window[0]);
  return activate(&window);
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

TEST(PointActivator, FindsDepthsToFractionsOfAPixel) {
  using namespace test;
  const SyntheticScene scene(3);
  const CameraModel camera = small_camera();
  Window window(camera);
  std::vector<SE3> poses;
  for (int i = 0; i < 4; ++i) {
    poses.push_back(keyframe_pose(i));
    window.insert(make_keyframe(static_cast<std::uint32_t>(i),
                                scene_view(scene, camera, poses.back()), poses.back()));
  }
  const std::vector<Point> points = scene_points(scene, camera, window[0].image(), poses, 0, 5);
  constexpr double kFactor = 1.05;
  add_immature(points, kFactor, &window[0]);
  ASSERT_GT(activate(&window), 50);
  const double baseline = (poses[3].translation() - poses[0].translation()).norm();
  std::vector<double> before;
  std::vector<double> after;
  for (const Point& p : window[0].points) {
    const double truth = 1.0 / scene.depth(camera, poses[0], Vec2(p.u, p.v));
    before.push_back(camera.fx * baseline * truth * (kFactor - 1.0));
    after.push_back(camera.fx * baseline * std::abs(p.rho - truth));
  }
  EXPECT_GT(median(before), 0.5) << "[px] in the farthest keyframe";
  EXPECT_LT(median(after), 0.1);
}

TEST(PointActivator, APointThatMostKeyframesDenyIsNone) {
  const int all = activated(0);
  EXPECT_GT(all, 50);
  EXPECT_GT(activated(1), 0.9 * all) << "one of three may be hidden";
  EXPECT_LT(activated(2), 0.4 * all) << "some fit by chance";
}

TEST(PointActivator, KeyframesThatSeeAPointFarLargerDenyNothing) {
  const double depth = test::SyntheticScene(3).depth(test::small_camera(), SE3(), Vec2(103, 78));
  const int all = activated(2, 0.6 * depth, false);
  EXPECT_GT(all, 20) << "the test needs points that stay in view";
  EXPECT_GT(activated(2, 0.6 * depth), 0.9 * all);
  EXPECT_LT(activated(2, 0.1 * depth), 0.4 * activated(2, 0.1 * depth, false));
}

}  // namespace
}  // namespace sovo
