#include "sovo/vo/lens_equations.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "support/numeric.h"
#include "vo/window_test_support.h"

namespace sovo {
namespace {

using namespace test;

/// Where a target sees a point of a host, both through a lens that is changed so.
Vec2 seen_through(const Window& window, int host, int target, const Point& point,
                  const Vec2& change) {
  const CameraModel& c = window.camera();
  const auto bent = [&](const Vec2& x) {
    return Vec2(x * (change[0] + change[1] * x.squaredNorm()));
  };
  const Vec2 taken((point.u - c.cx) / c.fx, (point.v - c.cy) / c.fy);
  const Vec2 left = taken - bent(taken);
  const SE3 T = window[target].T_camera_world * window[host].T_world_camera();
  const Vec3 p = T.rotation_matrix() * Vec3(left.x(), left.y(), 1.0) + T.translation() * point.rho;
  const Vec2 arrives = p.head<2>() / p.z();
  const Vec2 x = arrives + bent(arrives);
  return {c.fx * x.x() + c.cx, c.fy * x.y() + c.cy};
}

TEST(LensJacobian, IsThatOfCentralDifferences) {
  const Window window = scene_window(4);
  for (std::size_t i = 0; i < 40; ++i) {
    const Point& point = window[1].points[i];
    for (const int target : {0, 2, 3}) {
      const auto f = [&](const Vec2& c) { return seen_through(window, 1, target, point, c); };
      const Mat2 numeric = central_differences<2, 2>(f, Vec2(Vec2::Zero()), 1e-5);
      EXPECT_LT((lens_jacobian(window, 1, target, point) - numeric).norm(),
                1e-3 * std::max(1.0, numeric.norm()))
          << i << " in " << target;
    }
  }
}

/// A camera that moves to all sides and turns about all of its axes.
SE3 turned_pose(int i) {
  const double t = i;
  return {SO3::exp(Vec3(0.10 * std::sin(1.9 * t), 0.14 * std::sin(1.3 * t), 0.3 * std::sin(t))),
          Vec3(0.25 * std::sin(0.8 * t), 0.15 * std::sin(1.7 * t), 0.05 * t)};
}

/// The scene as such a camera sees it, in a window that takes it for `taken`; points have their
/// true depths.
Window turned_window(const CameraModel& taken) {
  static const SyntheticScene scene(3);
  constexpr int kViews = 7;
  const CameraModel camera = small_camera();
  std::vector<SE3> poses;
  for (int i = 0; i < kViews; ++i) poses.push_back(turned_pose(i));
  Window window(taken);
  for (int i = 0; i < kViews; ++i) {
    const SE3& pose = poses[static_cast<std::size_t>(i)];
    Keyframe& k = window.insert(
        make_keyframe(static_cast<std::uint32_t>(i), scene_view(scene, camera, pose), pose));
    if (i + 1 < kViews) k.points = scene_points(scene, camera, k.image(), poses, i, 3);
  }
  for (int h = 0; h < kViews; ++h) {
    for (Point& p : window[h].points) {
      for (int t = 0; t < kViews; ++t) {
        if (t != h)
          p.residuals[static_cast<std::size_t>(window[t].slot)].state = ResidualState::kIn;
      }
    }
  }
  window.update_geometry();
  return window;
}

/// What a window shows of its lens once bundle adjustment has bent the world to it.
LensEvidence shown_by(Window* window) {
  WorkerPool pool(1);
  WindowConfig config;
  config.lens_every = 1;
  const BundleResult result = BundleAdjuster(config, &pool).optimize(window);
  EXPECT_TRUE(result.lens.has_value());
  return result.lens.value_or(LensEvidence());
}

LensChange seen_by_window(const LensChange& wrong) {
  Window window = turned_window(with_changed_numbers(small_camera(), {wrong.focal, 0.0}));
  const LensEvidence lens = shown_by(&window);
  return LensChange::of(-lens.H.inverse() * lens.b);
}

TEST(LensEquations, SeeNoOtherFocalLengthWhereItIsRight) {
  EXPECT_LT(std::abs(seen_by_window({}).focal), 2e-3);
}

TEST(LensEquations, SeeAWrongFocalLength) {
  for (const double wrong : {-0.01, 0.01}) {
    const double seen = seen_by_window({wrong, 0.0}).focal;
    EXPECT_LT(seen / wrong, -0.7) << wrong;
    EXPECT_GT(seen / wrong, -1.3) << wrong;
  }
}

TEST(LensEquations, TellHowFarTheViewTurnsAndMoves) {
  Window window = turned_window(small_camera());
  double squares = 0.0;
  double ways = 0.0;
  int pairs = 0;
  for (int h = 0; h + 1 < window.size(); ++h) {
    for (int t = 0; t < window.size(); ++t) {
      if (t == h) continue;
      const Vec3 a = window[h].T_world_camera().rotation_matrix().col(2);
      const Vec3 b = window[t].T_world_camera().rotation_matrix().col(2);
      squares += std::pow(std::acos(a.dot(b)), 2);
      ways += (window[h].T_world_camera().translation() - window[t].T_world_camera().translation())
                  .squaredNorm();
      ++pairs;
    }
  }
  const double expected = std::sqrt(squares / pairs);
  EXPECT_GT(expected, 0.1);
  const double way = std::sqrt(ways / pairs) * window.mean_inverse_depth();
  const LensEvidence shown = shown_by(&window);
  EXPECT_NEAR(shown.turn, expected, 0.1 * expected);
  EXPECT_NEAR(shown.way, way, 0.1 * way);
}

TEST(LensEquations, AreAskedOfOneInSoManyKeyframes) {
  WorkerPool pool(1);
  WindowConfig config;
  const auto told = [&](int every) {
    Window window = turned_window(small_camera());  // its newest keyframe is number 6
    config.lens_every = every;
    return BundleAdjuster(config, &pool).optimize(&window).lens.has_value();
  };
  EXPECT_TRUE(told(1));
  EXPECT_TRUE(told(3));
  EXPECT_FALSE(told(4));
  EXPECT_FALSE(told(0));
  config.lens_every = 1;
  Window straight = scene_window(4);
  EXPECT_FALSE(BundleAdjuster(config, &pool).optimize(&straight).lens.has_value());
}

}  // namespace
}  // namespace sovo
