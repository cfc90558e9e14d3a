#include "sovo/vo/bundle_adjustment.h"

#include <gtest/gtest.h>

#include <cstring>

#include "support/numeric.h"
#include "vo/window_test_support.h"

namespace sovo {
namespace {

using namespace test;

constexpr int kKeyframes = 5;

/// The true window with poses, brightnesses and depths off by what tracking and tracing leave.
Window perturbed_window(double size) {
  Window window = scene_window(kKeyframes, 6);
  std::mt19937 random(11);
  for (int i = 1; i < window.size(); ++i) {
    Vec8 x;
    for (int k = 0; k < 8; ++k) x[k] = size * uniform(random, -1.0, 1.0);
    x.head<3>() *= 0.012;
    x.segment<3>(3) *= 0.003;
    x[6] *= 0.02;
    window[i].set_x(x);
    window[i].freeze();
  }
  for (int h = 0; h < window.size(); ++h) {
    for (Point& p : window[h].points) p.rho *= 1.0 + size * 0.05 * uniform(random, -1.0, 1.0);
  }
  window.update_geometry();
  return window;
}

/// Energy of what a window holds, with no residual counted as an outlier.
double energy_of(const WindowConfig& config, Window* window) {
  WorkerPool pool(1);
  BundleAdjuster adjuster(config, &pool);
  window->newest().outlier_threshold = 1e9;
  return linearized(config, window).energy + adjuster.prior_energy(*window);
}

int residuals_of(const Window& window) {
  int n = 0;
  for (int h = 0; h < window.size(); ++h) {
    for (const Point& p : window[h].points) n += p.count(ResidualState::kIn);
  }
  return n;
}

TEST(BundleAdjustment, EnergyNeverRisesFromOneIterationToTheNext) {
  WindowConfig config;
  config.min_iterations = 100;  // no early stop
  Window start = perturbed_window(1.0);
  const int all = residuals_of(start);
  const double first = energy_of(config, &start);
  double last = first;
  for (const int iterations : {1, 2, 4, 8}) {
    Window window = perturbed_window(1.0);
    WorkerPool pool(1);
    config.max_iterations = iterations;
    const BundleResult result = BundleAdjuster(config, &pool).optimize(&window);
    EXPECT_EQ(result.iterations, iterations);
    // Nothing may be bought by giving residuals up.
    ASSERT_EQ(residuals_of(window), all);
    const double energy = energy_of(config, &window);
    EXPECT_LE(energy, last * (1.0 + 1e-9)) << "after " << iterations;
    last = energy;
  }
  EXPECT_LT(last, 0.2 * first);
}

/// The same where motion blurred each keyframe in another way.
Window blurred_window(double size) {
  Window window = perturbed_window(size);
  for (int i = 0; i < window.size(); ++i) {
    window[i].velocity = (Vec6() << 0.1, 0.0, 0.0, 3.0 - i, 0.5 * i, 0.2).finished();
  }
  window.set_exposures(0.02);
  return window;
}

/// Its memory is that of the one before, and nothing else of it.
TEST(BundleAdjustment, RemembersNothingOfTheOneBefore) {
  WorkerPool pool(1);
  const auto optimized = [&](double size, BundleAdjuster* adjuster) {
    Window window = blurred_window(size);
    adjuster->optimize(&window);
    return window.stacked_x();
  };
  BundleAdjuster used(WindowConfig(), &pool);
  BundleAdjuster fresh(WindowConfig(), &pool);
  Window larger = blurred_window(0.3);
  for (int i = 0; i < larger.size(); ++i) *larger[i].velocity *= -2.0;
  larger.set_exposures(0.02);
  used.optimize(&larger);
  (void)optimized(0.7, &used);
  EXPECT_EQ(optimized(1.0, &used), optimized(1.0, &fresh));
}

TEST(BundleAdjustment, ConvergesToTheTruthUpToScale) {
  Window window = perturbed_window(1.0);
  WorkerPool pool(1);
  WindowConfig config;
  config.max_iterations = 30;
  const BundleResult result = BundleAdjuster(config, &pool).optimize(&window);
  EXPECT_TRUE(result.finite);
  EXPECT_LT(result.rmse, 2.5);
  EXPECT_GT(result.points, 300);

  // The first keyframe turns the world; the scale is free.
  const SE3 T_first_world = window[0].T_camera_world;
  EXPECT_LT(T_first_world.rotation().log().norm(), 1e-7);
  const auto seen_from_first = [&](int i) { return T_first_world * window[i].T_world_camera(); };
  double scale = 0.0;
  for (int i = 1; i < window.size(); ++i) {
    scale += seen_from_first(i).translation().norm() / keyframe_pose(i).translation().norm() /
             (window.size() - 1);
  }
  EXPECT_NEAR(scale, 1.0, 0.1);
  for (int i = 1; i < window.size(); ++i) {
    const SE3 estimate = seen_from_first(i);
    const Vec3 error = estimate.translation() / scale - keyframe_pose(i).translation();
    EXPECT_LT(error.norm(), 0.0015) << "keyframe " << i;
    const SE3 turn = estimate.inverse() * keyframe_pose(i);
    EXPECT_LT(turn.rotation().log().norm(), 4e-4) << "keyframe " << i;
    EXPECT_NEAR(window[i].affine.a, 0.0, 0.015);
  }
  const SyntheticScene scene(3);
  std::vector<double> errors;
  for (int h = 0; h < window.size(); ++h) {
    for (const Point& p : window[h].points) {
      const double depth = scene.depth(window.camera(), keyframe_pose(h), Vec2(p.u, p.v));
      errors.push_back(std::abs(p.rho * scale * depth - 1.0));
    }
  }
  std::nth_element(errors.begin(), errors.begin() + errors.size() * 9 / 10, errors.end());
  EXPECT_LT(errors[errors.size() / 2], 0.02);
  EXPECT_LT(errors[errors.size() * 9 / 10], 0.04);
}

TEST(BundleAdjustment, AnOlderKeyframeStaysWhereItWas) {
  Window window = scene_window(kKeyframes, 6, 1);  // the map's first keyframe has left
  Vec8 x = Vec8::Zero();
  x.head<3>() = Vec3(0.02, -0.03, 0.01);
  window.newest().set_x(x);
  window.newest().freeze();
  window.update_geometry();
  const std::vector<SE3> before = window.poses();
  WorkerPool pool(1);
  BundleAdjuster(WindowConfig(), &pool).optimize(&window);
  std::vector<double> moved;
  std::vector<double> turned;
  for (int i = 0; i < window.size(); ++i) {
    const SE3& T_world_camera = before[static_cast<std::size_t>(i)];
    moved.push_back(
        (window[i].T_world_camera().translation() - T_world_camera.translation()).norm());
    turned.push_back((window[i].T_camera_world * T_world_camera).rotation().log().norm());
  }
  EXPECT_LT(*std::min_element(turned.begin(), turned.end() - 1), 1e-12);
  EXPECT_LT(*std::min_element(moved.begin(), moved.end() - 1), 1e-12);
  EXPECT_LT(*std::max_element(moved.begin(), moved.end() - 1), 0.01);
  EXPECT_GT(moved.back(), 0.02);
}

TEST(BundleAdjustment, TheWorldDoesNotShakeWithItsOldestKeyframe) {
  Window window = scene_window(kKeyframes, 6, 1);
  Vec8 x = Vec8::Zero();
  x.head<3>() = Vec3(0.02, -0.03, 0.01);
  window[0].set_x(x);
  window[0].freeze();
  window.update_geometry();
  const std::vector<SE3> before = window.poses();
  WorkerPool pool(1);
  BundleAdjuster(WindowConfig(), &pool).optimize(&window);
  const auto moved = [&](int i) {
    return (window[i].T_camera_world * before[static_cast<std::size_t>(i)]).log().norm();
  };
  EXPECT_GT(moved(0), 0.02) << "it is put back";
  for (int i = 1; i + 1 < window.size(); ++i) EXPECT_LT(moved(i), 0.015) << i;
}

/// What three old keyframes and two new ones share is but every `kept`th of their points.
void loosen(int kept, Window* window) {
  constexpr int kOld = 3;
  int seen = 0;
  for (int h = 0; h < window->size(); ++h) {
    for (Point& p : (*window)[h].points) {
      if (++seen % kept == 0) continue;
      for (int t = 0; t < window->size(); ++t) {
        if ((h < kOld) == (t < kOld)) continue;
        p.residuals[static_cast<std::size_t>((*window)[t].slot)] = Residual();
      }
    }
  }
}

TEST(BundleAdjustment, TheWorldDoesNotGoWithOldKeyframesThatHardlyAnythingLinks) {
  for (const std::uint32_t first_id : {0U, 1U}) {
    Window window = scene_window(kKeyframes, 6, first_id);
    loosen(60, &window);
    Vec8 x = Vec8::Zero();
    x.head<3>() = Vec3(0.03, -0.02, 0.02);
    for (int i = 3; i < kKeyframes; ++i) {
      window[i].set_x(x);
      window[i].freeze();
    }
    window.update_geometry();
    const std::vector<SE3> before = window.poses();
    WorkerPool pool(1);
    BundleAdjuster(WindowConfig(), &pool).optimize(&window);
    const auto moved = [&](int i) {
      return (window[i].T_world_camera().translation() -
              before[static_cast<std::size_t>(i)].translation())
          .norm();
    };
    EXPECT_LT(moved(3), 1e-12);
    EXPECT_LT(moved(4), 0.01);
    for (int i = 0; i < 3; ++i) EXPECT_GT(moved(i), 0.02) << i;
  }
}

TEST(BundleAdjustment, AKeyframeThatHardlyAnythingPlacesStays) {
  const Window window = scene_window(3, 40, 1);
  const VecX units = BundleAdjuster::state_units(window);
  NormalEquations system;
  system.top = MatX::Zero(24, 24);
  system.schur = MatX::Zero(24, 24);
  system.b_schur = VecX::Zero(24);
  for (int i = 0; i < 24; ++i) system.top(i, i) = (i < 8 ? 1e3 : 1e9) / std::pow(units[i], 2);
  system.b_top = -0.01 * system.top * units;  // an undamped step is 0.01 of each
  WorkerPool pool(1);
  const VecX step =
      BundleAdjuster(WindowConfig(), &pool).solve(window, system, 0.0, false).cwiseQuotient(units);
  EXPECT_LT(step.head<3>().cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_NEAR(step[3], 0.01, 1e-4) << "its rotation is not held";
  for (int k = 8; k < 11; ++k) EXPECT_NEAR(step[k], 0.01, 1e-4);
}

/// Two keyframes of a camera that has moved by `step` [m] along x, the second one blurred by more;
/// depths are true, and each has a stereo match with this deviation of the log-depth.
Window two_keyframes(double step, double relative_sigma) {
  const SyntheticScene scene(3);
  const CameraModel camera = small_camera();
  const std::vector<SE3> poses{SE3(), SE3(SO3(), Vec3(step, 0.0, 0.0))};
  Window window(camera);
  const ImagePyramidPtr first = scene_view(scene, camera, poses[0]);
  const ImageF sharp = scene_view(scene, camera, poses[1])->level(0);
  window.insert(make_keyframe(0, first, poses[0])).points =
      scene_points(scene, camera, first->level(0), poses, 0, 6);
  window.insert(make_keyframe(1, pyramid_of(blurred(blurred(sharp))), poses[1]));
  for (Point& p : window[0].points) {
    p.residuals[static_cast<std::size_t>(window[1].slot)].state = ResidualState::kIn;
    const double sigma = relative_sigma * p.rho;
    p.static_information = static_cast<float>(100.0 / (sigma * sigma));
  }
  window.update_geometry();
  return window;
}

/// Inverse depths after bundle adjustment, relative to those before.
std::vector<double> moved_depths(Window window) {
  std::vector<double> before;
  for (const Point& p : window[0].points) before.push_back(p.rho);
  WorkerPool pool(1);
  (void)BundleAdjuster(WindowConfig(), &pool).optimize(&window);
  std::vector<double> ratios;
  for (std::size_t i = 0; i < before.size(); ++i) {
    ratios.push_back(window[0].points[i].rho / before[i]);
  }
  return ratios;
}

double worst_change(const std::vector<double>& ratios) {
  double worst = 0.0;
  for (const double r : ratios) worst = std::max(worst, std::abs(r - 1.0));
  return worst;
}

TEST(BundleAdjustment, WithoutParallaxTheDepthsOfStereoStay) {
  const double unknown = worst_change(moved_depths(two_keyframes(0.004, 1e9)));
  const double known = worst_change(moved_depths(two_keyframes(0.004, 0.01)));
  EXPECT_GT(unknown, 0.2);
  EXPECT_LT(known, 0.02);
}

TEST(BundleAdjustment, WithParallaxStereoHasNoSay) {
  EXPECT_EQ(moved_depths(two_keyframes(0.3, 1e9)), moved_depths(two_keyframes(0.3, 0.01)));
}

TEST(BundleAdjustment, NumberOfThreadsChangesNoBit) {
  std::vector<std::vector<double>> states;
  for (const int threads : {1, 2}) {
    Window window = perturbed_window(1.0);
    WorkerPool pool(threads);
    const BundleResult result = BundleAdjuster(WindowConfig(), &pool).optimize(&window);
    std::vector<double> state = {result.rmse};
    for (int i = 0; i < window.size(); ++i) {
      const Mat4 T = window[i].T_camera_world.matrix();
      state.insert(state.end(), T.data(), T.data() + 16);
      state.push_back(window[i].affine.a);
      state.push_back(window[i].affine.b);
      for (const Point& p : window[i].points) {
        state.push_back(p.rho);
        state.push_back(p.hessian);
      }
    }
    states.push_back(state);
  }
  for (std::size_t i = 1; i < states.size(); ++i) {
    ASSERT_EQ(states[i].size(), states[0].size());
    EXPECT_EQ(std::memcmp(states[i].data(), states[0].data(), 8 * states[0].size()), 0);
  }
}

TEST(BundleAdjustment, WrongPointsBecomeOutliersAndAreDropped) {
  Window window = perturbed_window(0.3);
  for (int i = 0; i < window.size(); ++i) {
    window[i].outlier_threshold = kPatternSize * WindowConfig().outlier_threshold;
  }
  std::vector<Point>& points = window[0].points;
  ASSERT_GT(points.size(), 40U);
  for (std::size_t i = 0; i < points.size(); i += 10) {
    // Half black, half white: fits nowhere.
    for (std::size_t k = 0; k < kPatternSize; ++k) points[i].colour[k] = k % 2 == 0 ? 0.F : 255.F;
  }
  WorkerPool pool(1);
  const BundleResult result = BundleAdjuster(WindowConfig(), &pool).optimize(&window);
  EXPECT_TRUE(result.finite);
  int good = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i % 10 == 0) {
      EXPECT_EQ(points[i].count(ResidualState::kIn), 0) << "point " << i;
      EXPECT_EQ(points[i].count(ResidualState::kOutlier), 0) << "outliers are dropped";
      EXPECT_EQ(points[i].last_state, ResidualState::kOutlier);
    } else if (points[i].count(ResidualState::kIn) == kKeyframes - 1) {
      EXPECT_EQ(points[i].good_residuals, kKeyframes - 1);
      EXPECT_GT(points[i].relative_baseline, 0.01F);
      ++good;
    }
  }
  EXPECT_GT(good, static_cast<int>(points.size()) / 2);
  EXPECT_LT(SE3(window[1].T_world_camera().inverse() * keyframe_pose(1)).log().tail<3>().norm(),
            0.001);
}

TEST(BundleAdjustment, NewestKeyframeEndsAtItsLinearizationPoint) {
  Window window = perturbed_window(1.0);
  WorkerPool pool(1);
  const auto first_estimate = [&window] {  // as seen from the oldest, which is held
    return SE3(window[1].frozen_T_camera_world * window[0].T_world_camera());
  };
  const SE3 before = first_estimate();
  BundleAdjuster(WindowConfig(), &pool).optimize(&window);
  EXPECT_TRUE(window.newest().x.isZero());
  EXPECT_FALSE(window[1].x.isZero());
  EXPECT_LT((first_estimate().inverse() * before).log().norm(), 1e-8) << "first estimates stay";
}

TEST(FramePrior, HoldsTheFirstKeyframeAndPullsBrightnessToZero) {
  const WindowConfig config;
  auto k = make_keyframe(0, nullptr, SE3(), {0.1, 2.0});
  const FramePrior first = frame_prior(*k, config);
  EXPECT_GT(first.weight.minCoeff(), 1e9);
  k->id = 4;
  const FramePrior later = frame_prior(*k, config);
  EXPECT_TRUE(later.weight.head<6>().isZero());
  EXPECT_EQ(later.weight[6], config.prior_a);
  EXPECT_EQ(later.weight[7], config.prior_b);
  EXPECT_EQ(later.error[6], 0.1);
  EXPECT_EQ(later.error[7], 2.0);
}

TEST(NormalEquations, DependOnlyOnResidualsThatTakePart) {
  Window window = scene_window(3, 12);
  const NormalEquations all = linearized(WindowConfig(), &window).system;
  EXPECT_LT((all.top - all.top.transpose()).norm(), 1e-9 * all.top.norm());
  EXPECT_LT((all.schur - all.schur.transpose()).norm(), 1e-9 * all.schur.norm());
  const auto slot = static_cast<std::size_t>(window[2].slot);
  for (const PointRef& ref : collect_points(&window)) {
    ref.point->residuals[slot].state = ResidualState::kOutOfView;
  }
  const NormalEquations fewer = linearized(WindowConfig(), &window).system;
  EXPECT_LT(fewer.residuals, all.residuals);
  EXPECT_TRUE(fewer.top.bottomRows(8).isZero());
  EXPECT_TRUE(fewer.schur.bottomRows(8).isZero());
}

}  // namespace
}  // namespace sovo
