#include "sovo/vo/static_residual.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "sovo/vo/marginalization.h"
#include "support/numeric.h"
#include "vo/static_residual_support.h"

namespace sovo {
namespace {

using namespace test;

LinearizedResidual static_residual(const Window& window, int host, const Point& point) {
  LinearizedResidual out;
  linearize_static(*window.rig(), WindowConfig(), window[host], point, point.rho, &out);
  return out;
}

TEST(StaticResidual, MovesWithInverseDepthAsCentralDifferencesSay) {
  const Window window = stereo_window();
  int checked = 0;
  for (Point p : window[1].points) {
    const LinearizedResidual at = static_residual(window, 1, p);
    if (at.state == ResidualState::kOutOfView) continue;
    const double rho = p.rho;
    const auto centre = [&](const Eigen::Matrix<double, 1, 1>& x) {
      p.rho = x[0];
      const Vec3 ray((static_cast<double>(p.u) - window.camera().cx) / window.camera().fx,
                     (static_cast<double>(p.v) - window.camera().cy) / window.camera().fy, 1.0);
      return Vec2(*window.rig()->right.project(window.rig()->T_right_left * Vec3(ray / p.rho)));
    };
    const Vec2 slope = central_differences<2, 1>(centre, Eigen::Matrix<double, 1, 1>(rho), 1e-5);
    EXPECT_LT(relative_difference(
                  Vec2(static_cast<double>(at.du_rho), static_cast<double>(at.dv_rho)), slope),
              1e-3);
    const Vec2 seen = centre(Eigen::Matrix<double, 1, 1>(rho));
    EXPECT_NEAR(static_cast<double>(at.centre_u), seen.x(), 1e-3);
    EXPECT_NEAR(static_cast<double>(at.centre_v), seen.y(), 1e-3);
    ++checked;
  }
  EXPECT_GT(checked, 50);
}

TEST(StaticResidual, HoldsTheScaleUntilThePriorHasForgottenIt) {
  Window window = stereo_window();
  const auto set_all = [&](ResidualState state) {
    for (int i = 0; i < window.size(); ++i) {
      for (Point& p : window[i].points) p.static_state = state;
    }
  };
  ASSERT_TRUE(window.scale_held());
  set_all(ResidualState::kOutOfView);
  for (int i = 0; i < 19; ++i) {
    window.update_scale_held();
    EXPECT_TRUE(window.scale_held()) << i;
  }
  window.update_scale_held();
  EXPECT_FALSE(window.scale_held());
  set_all(ResidualState::kIn);
  window.update_scale_held();
  EXPECT_TRUE(window.scale_held());
}

TEST(StaticResidual, LiesWhereTheRightCameraWasAtItsOwnExposure) {
  Window window = stereo_window();
  const SE3 T_later_left(SO3::exp(Vec3(0.004, -0.006, 0.003)), Vec3(0.01, -0.005, -0.03));
  const auto project = [&](const Point& p, const SE3& T_later) {
    const Vec3 ray((static_cast<double>(p.u) - window.camera().cx) / window.camera().fx,
                   (static_cast<double>(p.v) - window.camera().cy) / window.camera().fy, 1.0);
    const Vec3 point = T_later * Vec3(ray / static_cast<double>(p.rho));
    return Vec2(*window.rig()->right.project(window.rig()->T_right_left * point));
  };
  window[1].T_later_left = T_later_left;
  int checked = 0;
  for (const Point& p : window[1].points) {
    const LinearizedResidual at = static_residual(window, 1, p);
    if (at.state == ResidualState::kOutOfView) continue;
    const Vec2 centre(static_cast<double>(at.centre_u), static_cast<double>(at.centre_v));
    EXPECT_LT((centre - project(p, T_later_left)).norm(), 1e-3);
    EXPECT_GT((centre - project(p, SE3())).norm(), 0.1);
    ++checked;
  }
  EXPECT_GT(checked, 50);
}

TEST(StaticResidual, FindsTheDepthByItself) {
  // Through a bent lens, and from three per cent beside it: a third of a pixel and more.
  const Window window = stereo_window();
  std::vector<double> errors;
  for (const double off : {0.97, 1.03}) {
    for (Point p : window[1].points) {
      const double truth = p.rho;
      p.rho *= off;
      LinearizedResidual at;
      for (int i = 0; i < 6; ++i) {
        at = static_residual(window, 1, p);
        if (at.state == ResidualState::kOutOfView || !is_textured(at)) break;
        const DepthPart part = depth_part(at);
        p.rho -= static_cast<double>(part.gradient) / static_cast<double>(part.hessian);
      }
      if (at.state == ResidualState::kOutOfView || depth_part(at).hessian * p.rho * p.rho < 500.0) {
        continue;
      }
      const double slope = std::hypot(at.du_rho, at.dv_rho);
      errors.push_back(slope * std::abs(p.rho - truth));  // of disparity [px]
    }
  }
  ASSERT_GT(errors.size(), 60U);
  std::sort(errors.begin(), errors.end());
  // Walls are slanted, and a pattern is taken as facing us.
  EXPECT_LT(errors[errors.size() / 2], 0.1);
  EXPECT_LT(errors[errors.size() * 9 / 10], 0.25);
}

TEST(StaticResidual, WhatTheRightCameraDoesNotSeeIsOutOfView) {
  const Window window = stereo_window();
  Point p = window[1].points.front();
  p.rho = 20.0;  // 5 cm before a baseline of 12 cm
  EXPECT_EQ(static_residual(window, 1, p).state, ResidualState::kOutOfView);
}

TEST(StaticResidual, BrightnessOfTheRightCameraIsFoundFromThePoints) {
  const Grey darker = [](int /*keyframe*/, int /*x*/, int /*y*/, float seen) {
    return 0.7F * seen + 25.0F;
  };
  const Window window = stereo_window(darker);
  EXPECT_NEAR(window[0].right_brightness.gain, 0.7, 0.02);
  EXPECT_NEAR(window[0].right_brightness.bias, 25.0, 3.0);
  // The newest keyframe hosts nothing that could tell.
  EXPECT_EQ(window.newest().right_brightness.gain, 1.0);
  EXPECT_EQ(window.newest().right_brightness.bias, 0.0);
}

TEST(StaticResidual, BrightnessOfTheRightCameraIsRefinedFromItsResiduals) {
  const Grey darker = [](int /*keyframe*/, int /*x*/, int /*y*/, float seen) {
    return 0.7F * seen + 25.0F;
  };
  Window window = stereo_window(darker);
  Keyframe& k = window[1];
  for (const Vec2& off : {Vec2(1.1, 5.0), Vec2(0.93, -4.0)}) {
    k.right_brightness = {0.7 * off.x(), 25.0 + off.y()};
    for (int i = 0; i < 4; ++i) refine_right_brightness(*window.rig(), WindowConfig(), 1.0, &k);
    // A little less than 0.7: between its pixels the right image has less contrast.
    EXPECT_NEAR(k.right_brightness.gain, 0.69, 0.02);
    EXPECT_NEAR(k.right_brightness.bias, 26.5, 3.0);
  }
  // Nothing to refine it from, and nothing that moves it.
  for (Point& p : k.points) p.static_state = ResidualState::kAbsent;
  const BrightnessTransfer before = k.right_brightness;
  refine_right_brightness(*window.rig(), WindowConfig(), 1.0, &k);
  EXPECT_EQ(k.right_brightness.gain, before.gain);
  EXPECT_EQ(k.right_brightness.bias, before.bias);
}

TEST(StaticResidual, ToLeaveTheViewIsNoGain) {
  WorkerPool pool(1);
  Window window = stereo_window();
  PhotometricProblem problem(WindowConfig(), collect_points(&window), &window, &pool);
  WindowLinearization now;
  problem.linearize(problem.stored(), {}, &now);
  const auto worst = std::max_element(
      now.statics.begin(), now.statics.end(),
      [](const StoredStatic& a, const StoredStatic& b) { return a.energy < b.energy; });
  ASSERT_GT(worst->energy, 0.0F);
  const auto i = static_cast<std::size_t>(worst - now.statics.begin());
  problem.points()[i].point->rho = 20.0;  // 5 cm before a baseline of 12 cm
  WindowLinearization next;
  problem.linearize(now, {}, &next);
  EXPECT_EQ(next.statics[i].state, ResidualState::kOutOfView);
  EXPECT_EQ(next.statics[i].energy, worst->energy);
}

/// Eigenvalues, ascending, of the poses' part of the system after elimination of the depths.
VecX pose_eigenvalues(Window* window) {
  WindowConfig config;
  config.prior_a = config.prior_b = config.depth_damping = config.place_damping = 0.0;
  const NormalEquations system = linearized(config, window).system;
  const VecX units = BundleAdjuster::state_units(*window);
  const MatX H = units.asDiagonal() * (system.top - system.schur) * units.asDiagonal();
  std::vector<Eigen::Index> poses;
  for (Eigen::Index i = 0; i < H.rows(); ++i) {
    if (i % 8 < 6) poses.push_back(i);
  }
  const MatX block = H(poses, poses);
  VecX e = Eigen::SelfAdjointEigenSolver<MatX>(block).eigenvalues().cwiseAbs();
  std::sort(e.begin(), e.end());
  return e;
}

TEST(StaticResidual, SixGaugeDirectionsAreLeft) {
  Window window = stereo_window();
  const VecX units = BundleAdjuster::state_units(window);
  ASSERT_EQ(BundleAdjuster::gauge_basis(window, units).cols(), 6);
  const VecX e = pose_eigenvalues(&window);
  EXPECT_LT(e[5], 1e-6 * e.maxCoeff());
  EXPECT_GT(e[6], 1e4 * e[5]);
  Window mono = scene_window(kStereoKeyframes, kStride, 1);
  const VecX f = pose_eigenvalues(&mono);
  EXPECT_LT(f[6], 1e-6 * f.maxCoeff());
  EXPECT_GT(f[7], 1e4 * f[6]);
}

TEST(StaticResidual, BringBackAScaleThatMonocularResidualsLeave) {
  for (const double wrong : {0.97, 1.03}) {
    Window window = stereo_window();
    window.apply_similarity(wrong);
    EXPECT_NEAR(adjusted_scale(&window), 1.0, 2e-3) << wrong;
    Window mono = scene_window(kStereoKeyframes, kStride, 1);
    mono.apply_similarity(wrong);
    EXPECT_NEAR(adjusted_scale(&mono), wrong, 5e-3);
  }
}

TEST(StaticResidual, AnotherBrightnessDoesNotMoveTheScale) {
  const Grey darker = [](int /*keyframe*/, int /*x*/, int /*y*/, float seen) {
    return 0.7F * seen + 25.0F;
  };
  Window window = stereo_window(darker);
  window.apply_similarity(1.02);
  EXPECT_NEAR(adjusted_scale(&window), 1.0, 3e-3);
}

TEST(StaticResidual, WhatDoesNotFitIsAnOutlierAndLeaves) {
  // The lower part of each right image shows something else.
  const Grey covered = [](int keyframe, int x, int y, float seen) {
    return y < 80 ? seen : ((x / 5 + y / 7 + keyframe) % 2 == 0 ? 20.0F : 230.0F);
  };
  Window window = stereo_window(as_seen);
  Window half = stereo_window(covered);
  for (int i = 0; i < half.size(); ++i) {
    half[i].outlier_threshold = 400.0;
    half[i].right_brightness = window[i].right_brightness;
  }
  half.apply_similarity(1.01);
  EXPECT_NEAR(adjusted_scale(&half), 1.0, 5e-3);
  int left = 0;
  int above = 0;
  for (int h = 0; h < half.size(); ++h) {
    for (const Point& p : half[h].points) {
      if (p.static_state == ResidualState::kAbsent) continue;
      const LinearizedResidual r = static_residual(half, h, p);
      ++(r.centre_v < 76.0F ? above : left);
    }
  }
  EXPECT_GT(above, 60);
  EXPECT_LT(left, above / 10) << "residuals into what covers the view";
}

TEST(StaticResidual, KeyframesWithoutARightImageHaveNone) {
  Window window = scene_window(kStereoKeyframes, kStride, 1);
  Window mono = scene_window(kStereoKeyframes, kStride, 1);
  window.set_rig(bent_rig());
  window.update_scale_held();
  EXPECT_FALSE(window.scale_held());
  adjusted_scale(&window);
  adjusted_scale(&mono);
  for (int i = 0; i < window.size(); ++i) {
    EXPECT_TRUE(window[i].T_camera_world.matrix() == mono[i].T_camera_world.matrix());
  }
}

TEST(StaticResidual, PassIntoThePriorWithTheirPoints) {
  // Without it a window would lose its scale with each keyframe that leaves.
  WorkerPool pool(1);
  Window window = stereo_window();
  std::vector<PointRef> leaving;
  for (Point& p : window[0].points) leaving.push_back({0, &p});
  marginalize_points(WindowConfig(), leaving, &window, &pool);
  const VecX units = BundleAdjuster::state_units(window);
  VecX scale = VecX::Zero(units.size());
  for (int i = 0; i < window.size(); ++i) {
    scale.segment<3>(8 * i) = window[i].frozen_T_camera_world.translation();
  }
  const double held = scale.dot(window.prior().H * scale);
  Window mono = scene_window(kStereoKeyframes, kStride, 1);
  leaving.clear();
  for (Point& p : mono[0].points) leaving.push_back({0, &p});
  marginalize_points(WindowConfig(), leaving, &mono, &pool);
  EXPECT_GT(held, 100.0);
  EXPECT_LT(std::abs(scale.dot(mono.prior().H * scale)), 1e-3 * held);
}

TEST(StaticResidual, VarianceOfTheScaleIsThatOfNoisyRightImages) {
  std::vector<double> scales;
  double claimed = 0.0;
  constexpr int kSeeds = 24;
  constexpr float kNoise = 4.0F;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    std::mt19937 random(seed);
    const Grey noisy = [&](int /*keyframe*/, int /*x*/, int /*y*/, float seen) {
      return seen + kNoise * static_cast<float>(normal(random));
    };
    Window window = stereo_window(noisy);
    BundleResult result;
    scales.push_back(std::log(adjusted_scale(&window, &result)));
    claimed += result.scale_variance / kSeeds;
  }
  double mean = 0.0;
  for (const double s : scales) mean += s / kSeeds;
  double variance = 0.0;
  for (const double s : scales) variance += (s - mean) * (s - mean) / (kSeeds - 1);
  // What it claims is made for pixels that err alike, with temporal residuals in its mean.
  EXPECT_GT(claimed, 0.5 * variance);
  EXPECT_LT(claimed, 20.0 * variance);
}

}  // namespace
}  // namespace sovo
