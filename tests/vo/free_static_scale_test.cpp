#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <random>
#include <vector>

#include "sovo/vo/marginalization.h"
#include "sovo/vo/median.h"
#include "support/numeric.h"
#include "vo/static_residual_support.h"

namespace sovo {
namespace {

using namespace test;

/// A window whose map is too large by this factor, with static residuals that leave that be.
Window free_window(double too_large) {
  Window window = stereo_window(as_seen, StaticScale::kFree);
  window.apply_similarity(too_large);
  window.rescale_statics(1.0 / too_large);  // nothing is known of it yet
  return window;
}

TEST(FreeStaticScale, IsFoundAndTheMapKeepsItsOwn) {
  for (const double wrong : {0.97, 1.03}) {
    Window window = free_window(wrong);
    EXPECT_FALSE(window.scale_held());
    EXPECT_EQ(BundleAdjuster::gauge_basis(window, BundleAdjuster::state_units(window)).cols(), 7);
    EXPECT_NEAR(adjusted_scale(&window), wrong, 5e-3);
    EXPECT_NEAR(window.static_scale(), wrong, 5e-3);
  }
}

TEST(FreeStaticScale, PointsThatTheRightImageAloneSeesFitTheMap) {
  constexpr double kWrong = 1.03;
  const Window truth = stereo_window();
  Window window = free_window(kWrong);
  std::mt19937 random(1);
  std::vector<double> size_before;
  for (Point& p : window[1].points) {
    const double error = 0.03 * normal(random);
    p.rho *= std::exp(error);
    size_before.push_back(std::abs(error));
    for (Residual& r : p.residuals) r = Residual();
  }
  adjusted_scale(&window);
  std::vector<double> off;
  for (std::size_t i = 0; i < window[1].points.size(); ++i) {
    const Point& p = window[1].points[i];
    if (p.static_state == ResidualState::kIn) {
      off.push_back(std::log(p.rho * kWrong / truth[1].points[i].rho));
    }
  }
  ASSERT_GT(off.size(), 50U);
  std::vector<double> size;
  std::transform(off.begin(), off.end(), std::back_inserter(size),
                 [](double x) { return std::abs(x); });
  EXPECT_NEAR(sovo::median(&off), 0.0, 3e-3) << "not where stereo has them";
  EXPECT_LT(sovo::median(&size), 0.6 * sovo::median(&size_before));
}

TEST(FreeStaticScale, DisplacedRightImagesMoveItByAsMuchAsIsSaidOfAHeldOne) {
  WorkerPool pool(1);
  const auto optimized = [&pool](double px, StaticScale scale, BundleResult* result) {
    Window window = stereo_window(as_seen, scale);
    StereoRig rig = *window.rig();
    rig.right.cx += px;
    window.set_rig(rig, scale);
    *result = BundleAdjuster(WindowConfig(), &pool).optimize(&window);
    return std::log(window.static_scale());
  };
  constexpr double kPx = 0.1;
  BundleResult held;
  BundleResult free;
  optimized(0.0, StaticScale::kHeld, &held);
  const double change =
      optimized(kPx, StaticScale::kFree, &free) - optimized(-kPx, StaticScale::kFree, &free);
  EXPECT_EQ(free.scale_per_px, 0.0);
  EXPECT_GT(held.scale_per_px, 0.05) << "the displacement is one of disparities of few pixels";
  // One is found in a single step before the depths move, the other told of where they came to.
  EXPECT_NEAR(std::abs(change) / (2.0 * kPx), held.scale_per_px, 0.25 * held.scale_per_px);
}

TEST(FreeStaticScale, GoesAlongWithASimilarity) {
  Window window = free_window(1.02);
  adjusted_scale(&window);
  const auto energy = [&window] {
    double sum = 0.0;
    for (const StoredStatic& s : linearized(WindowConfig(), &window).statics) {
      sum += static_cast<double>(s.energy);
    }
    return sum;
  };
  const double before = energy();
  ASSERT_GT(before, 0.0);
  window.apply_similarity(1.4);
  EXPECT_NEAR(energy(), before, 1e-3 * before);
}

TEST(FreeStaticScale, DepthsHaveTheDerivativesOfCentralDifferences) {
  Window window = stereo_window(as_seen, StaticScale::kFree);
  window.apply_similarity(1.4);
  const WindowConfig config;
  const WindowLinearization at = linearized(config, &window);
  WorkerPool pool(1);
  int checked = 0;
  const std::vector<PointRef> points = collect_points(&window);
  for (std::size_t i = 0; i < points.size(); i += 7) {
    if (at.statics[i].state != ResidualState::kIn) continue;
    Point& p = *points[i].point;
    const double rho = p.rho;
    const auto gradient = [&](const Eigen::Matrix<double, 1, 1>& x) {
      p.rho = x[0];
      PhotometricProblem problem(config, {points[i]}, &window, &pool);
      WindowLinearization out;
      problem.linearize(problem.stored(), {.targets = 0}, &out);
      return Eigen::Matrix<double, 1, 1>(static_cast<double>(out.statics[0].depth.gradient));
    };
    // Of squares of a smooth pattern near its place the gradient rises by the Hessian.
    const double slope =
        central_differences<1, 1>(gradient, Eigen::Matrix<double, 1, 1>(rho), 1e-3 * rho)(0, 0);
    p.rho = rho;
    const auto hessian = static_cast<double>(at.statics[i].depth.hessian);
    checked += std::abs(slope - hessian) < 0.3 * hessian ? 1 : 0;
  }
  EXPECT_GT(checked, 10);
}

TEST(FreeStaticScale, WhatLeavesPullsTheMapToMetres) {
  WorkerPool pool(1);
  const auto pull = [&pool](double too_large) {
    Window window = free_window(too_large);
    window.rescale_statics(too_large);  // found
    std::vector<PointRef> leaving;
    for (Point& p : window[0].points) leaving.push_back({0, &p});
    marginalize_points(WindowConfig(), leaving, &window, &pool);
    double gradient = 0.0;
    for (int i = 0; i < window.size(); ++i) {
      gradient += window.prior().b.segment<3>(8 * i).dot(window[i].T_camera_world.translation());
    }
    return gradient;
  };
  EXPECT_GT(pull(1.01), 0.0);
  EXPECT_LT(pull(0.99), 0.0);
  EXPECT_GT(pull(1.01) - pull(0.99), 10.0 * std::abs(pull(1.0)));
}

}  // namespace
}  // namespace sovo
