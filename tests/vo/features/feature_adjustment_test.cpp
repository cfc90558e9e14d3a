#include "sovo/vo/features/feature_adjustment.h"

#include <gtest/gtest.h>

#include <cmath>

#include "vo/features/feature_test_support.h"

namespace sovo {
namespace {

using namespace test;

/// Small changes of all that bundle adjustment may change.
FeatureWindow disturbed(FeatureWindow window, const FeatureAdjuster& adjuster, double size,
                        std::uint32_t seed) {
  std::mt19937 random(seed);
  for (std::size_t k = adjuster.first_free(window); k < window.keyframes.size(); ++k) {
    Vec6 x;
    for (int i = 0; i < 6; ++i) x[i] = size * normal(random);
    window.keyframes[k].T_camera_world = SE3::exp(x) * window.keyframes[k].T_camera_world;
  }
  for (FeatureLandmark& l : window.landmarks) l.rho *= std::exp(5.0 * size * normal(random));
  return window;
}

double worst_pose_error(const FeatureWindow& window) {
  double worst = 0.0;
  for (const FeatureKeyframe& k : window.keyframes) {
    const SE3 error = k.T_camera_world * feature_pose(static_cast<int>(k.id)).inverse();
    worst = std::max(worst, error.log().norm());
  }
  return worst;
}

TEST(FeatureAdjuster, SystemIsThatOfTheEnergysDifferences) {
  FeatureConfig config;
  config.free_keyframes = 3;
  FeatureAdjuster adjuster(config);
  const FeatureWindow window = disturbed(true_window(5, 40, 0.5, 1), adjuster, 2e-4, 2);
  const FeatureAdjuster::System s = adjuster.linearize(window);
  ASSERT_EQ(s.b.size(), 18);
  const auto energy_after = [&](const VecX& frames, const VecX& depths) {
    FeatureWindow moved = window;
    adjuster.take_step(frames, depths, &moved);
    return adjuster.linearize(moved).energy;
  };
  const VecX no_frames = VecX::Zero(s.b.size());
  const VecX no_depths = VecX::Zero(static_cast<Eigen::Index>(window.landmarks.size()));
  constexpr double kStep = 1e-7;
  const double scale = s.b.cwiseAbs().maxCoeff();
  for (Eigen::Index i = 0; i < s.b.size(); ++i) {
    VecX x = no_frames;
    x[i] = kStep;
    const double slope = (energy_after(x, no_depths) - energy_after(-x, no_depths)) / (2.0 * kStep);
    EXPECT_NEAR(-slope, s.b[i], 1e-4 * scale) << i;
  }
  for (Eigen::Index i = 0; i < no_depths.size(); i += 7) {
    VecX x = no_depths;
    x[i] = kStep;
    const double slope = (energy_after(no_frames, x) - energy_after(no_frames, -x)) / (2.0 * kStep);
    EXPECT_NEAR(-slope, s.b_rho[static_cast<std::size_t>(i)], 1e-4 * scale) << i;
  }
}

TEST(FeatureAdjuster, FindsBackToTheTruthAndHoldsTheOldKeyframes) {
  FeatureConfig config;
  config.free_keyframes = 4;
  config.max_iterations_window = 10;
  config.depth_damping = 0.0;
  FeatureAdjuster adjuster(config);
  FeatureWindow window = disturbed(true_window(7, 200, 0.0, 3), adjuster, 3e-3, 4);
  ASSERT_GT(worst_pose_error(window), 5e-3);
  const BundleResult result = adjuster.optimize(&window);
  EXPECT_TRUE(result.finite);
  EXPECT_LT(worst_pose_error(window), 1e-5);
  EXPECT_LT(result.rmse, 1e-3);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(window.keyframes[static_cast<std::size_t>(i)].T_camera_world.matrix(),
              feature_pose(i).matrix())
        << "held";
  }
}

TEST(FeatureAdjuster, OutliersAreMarkedAndPullAtNothingElse) {
  FeatureConfig config;
  config.free_keyframes = 3;
  FeatureAdjuster adjuster(config);
  FeatureWindow window = true_window(6, 200, 0.2, 5);
  std::vector<std::pair<std::size_t, std::size_t>> wrong;
  for (std::size_t i = 0; i < window.landmarks.size(); i += 10) {
    auto& observations = window.landmarks[i].observations;
    if (observations.size() < 3) continue;
    observations[1].pixel += Vec2(12.0, -9.0);
    wrong.emplace_back(i, 1);
  }
  ASSERT_GT(wrong.size(), 10U);
  adjuster.optimize(&window);
  EXPECT_LT(worst_pose_error(window), 2e-3);
  int marked = 0;
  for (const auto& [landmark, observation] : wrong) {
    marked += window.landmarks[landmark].observations[observation].inlier ? 0 : 1;
  }
  EXPECT_EQ(marked, static_cast<int>(wrong.size()));
  int others = 0;
  int all = 0;
  for (const FeatureLandmark& l : window.landmarks) {
    all += static_cast<int>(l.observations.size());
    others += static_cast<int>(l.observations.size()) - l.num_inliers();
  }
  EXPECT_LT(others - marked, 0.03 * all);
}

TEST(FeatureAdjuster, WhatNoParallaxShowsStaysAsItIs) {
  // A camera that only turns: depths, and with them the scale, are told by nothing.
  FeatureConfig config;
  FeatureAdjuster adjuster(config);
  FeatureWindow window = true_window(5, 100, 0.3, 6);
  std::vector<double> before;
  for (FeatureKeyframe& k : window.keyframes) k.T_camera_world.translation().setZero();
  std::mt19937 random(7);
  for (FeatureLandmark& l : window.landmarks) {
    l.static_sigma = 0.02 * l.rho;
    before.push_back(l.rho);
    for (Observation& o : l.observations) {
      Vec2 pixel;
      ASSERT_TRUE(reproject(window.camera, window.T_target_host(o.keyframe_id, l.host_id), l.ray,
                            l.rho, &pixel));
      o.pixel = pixel + 0.3 * Vec2(normal(random), normal(random));
    }
  }
  for (int i = 0; i < 5; ++i) adjuster.optimize(&window);
  double sum = 0.0;
  for (std::size_t i = 0; i < before.size(); ++i)
    sum += std::log(window.landmarks[i].rho / before[i]);
  EXPECT_NEAR(sum / static_cast<double>(before.size()), 0.0, 1e-3);
}

TEST(FeatureAdjuster, ALandmarkThatNothingTellsOfStaysAndBreaksNothing) {
  FeatureConfig config;
  config.depth_damping = 0.0;
  FeatureAdjuster adjuster(config);
  FeatureWindow window = true_window(5, 100, 0.2, 10);
  FeatureLandmark unseen = window.landmarks.front();
  unseen.observations.clear();
  window.landmarks.push_back(unseen);
  EXPECT_TRUE(adjuster.optimize(&window).finite);
  EXPECT_EQ(window.landmarks.back().rho, unseen.rho);
  EXPECT_LT(worst_pose_error(window), 5e-3);
}

TEST(FeatureAdjuster, CovarianceOfTheNewestKeyframeIsHonest) {
  FeatureConfig config;
  config.free_keyframes = 3;
  config.depth_damping = 0.0;
  FeatureAdjuster adjuster(config);
  double nees = 0.0;
  constexpr int kWindows = 60;
  for (std::uint32_t seed = 0; seed < kWindows; ++seed) {
    FeatureWindow window = true_window(6, 150, 0.3, 100 + seed);
    const BundleResult result = adjuster.optimize(&window);
    const auto between = [](const SE3& newest, const SE3& before) {
      return newest * before.inverse();
    };
    const SE3 found =
        between(window.keyframes[5].T_camera_world, window.keyframes[4].T_camera_world);
    const SE3 truth = between(feature_pose(5), feature_pose(4));
    const Vec6 error = (found * truth.inverse()).log();
    nees += error.dot(result.newest_covariance.inverse() * error) / 6.0;
  }
  nees /= kWindows;
  // It counts what residuals of one landmark share, which these do not.
  constexpr double kSharedHost = 4.0;
  EXPECT_GT(kSharedHost * nees, 0.6);
  EXPECT_LT(kSharedHost * nees, 1.6);
}

TEST(FeatureWindow, SimilarityScalesAllLengthsAndNoPixel) {
  FeatureWindow window = true_window(5, 50, 0.2, 8);
  FeatureConfig config;
  FeatureAdjuster adjuster(config);
  adjuster.optimize(&window);
  const FeatureWindow before = window;
  const double energy = adjuster.linearize(window).energy;
  window.apply_similarity(2.5);
  EXPECT_NEAR(adjuster.linearize(window).energy, energy, 1e-9 * energy);
  const Vec3 centre = before.newest().T_camera_world.inverse().translation();
  EXPECT_LT((window.newest().T_camera_world.inverse().translation() - centre).norm(), 1e-12);
  EXPECT_NEAR(window.mean_inverse_depth(), before.mean_inverse_depth() / 2.5, 1e-12);
  EXPECT_NEAR(window.landmarks[7].sigma(2.0) * 2.5, before.landmarks[7].sigma(2.0), 1e-12);
}

TEST(FeatureWindow, TheOldestKeyframeLeavesWithAllThatHangsOnIt) {
  FeatureWindow window = true_window(5, 50, 0.2, 9);
  window.drop_oldest();
  ASSERT_EQ(window.keyframes.size(), 4U);
  EXPECT_EQ(window.keyframes.front().id, 1U);
  EXPECT_EQ(window.keyframe(3).id, 3U);
  for (const FeatureLandmark& l : window.landmarks) {
    EXPECT_NE(l.host_id, 0U);
    EXPECT_EQ(l.seen_in(0), nullptr);
  }
}

}  // namespace
}  // namespace sovo
