#include "sovo/vo/marginalization.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "support/numeric.h"
#include "vo/window_test_support.h"

namespace sovo {
namespace {

using namespace test;

double quadratic(const MatX& H, const VecX& b, const VecX& x) {
  return x.dot(H * x) + 2.0 * b.dot(x);
}

/// Least value of a quadratic over its last `n` variables, the first held.
double least_over_last(const MatX& H, const VecX& b, const VecX& first, Eigen::Index n) {
  const VecX gradient = b.tail(n) + H.bottomLeftCorner(n, first.size()) * first;
  VecX x(b.size());
  x << first, -H.bottomRightCorner(n, n).ldlt().solve(gradient);
  return quadratic(H, b, x);
}

VecX random_vector(std::mt19937* random, Eigen::Index n) {
  VecX v(n);
  for (double& value : v) value = normal(*random);
  return v;
}

TEST(EliminateLast, LeavesTheLeastEnergyOverWhatIsEliminated) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 10; ++trial) {
    MatX root(24, 24);
    for (double& value : root.reshaped()) value = normal(random);
    // States differ in size by orders of magnitude.
    VecX unit(24);
    for (double& value : unit) value = std::pow(10.0, uniform(random, 0.0, 4.0));
    const MatX H = unit.asDiagonal() * (root * root.transpose()) * unit.asDiagonal();
    const VecX b = unit.cwiseProduct(random_vector(&random, 24));
    MatX reduced_H = H;
    VecX reduced_b = b;
    eliminate_last(8, &reduced_H, &reduced_b);
    ASSERT_EQ(reduced_b.size(), 16);
    const double offset = least_over_last(H, b, VecX::Zero(16), 8);
    for (int k = 0; k < 5; ++k) {
      const VecX x = unit.head(16).cwiseInverse().cwiseProduct(random_vector(&random, 16));
      const double full = least_over_last(H, b, x, 8) - offset;
      EXPECT_NEAR(quadratic(reduced_H, reduced_b, x), full, 1e-6 * std::abs(full) + 1e-8);
    }
  }
}

TEST(EliminateLast, LeavesOutDirectionsWithoutInformation) {
  MatX H = MatX::Zero(16, 16);
  H.topLeftCorner(8, 8).diagonal().setConstant(1e4);
  VecX b = VecX::Zero(16);
  b[3] = 5.0;
  eliminate_last(8, &H, &b);
  EXPECT_TRUE(H.allFinite());
  EXPECT_LT((H - MatX(1e4 * MatX::Identity(8, 8))).norm(), 1e-6);
  EXPECT_NEAR(b[3], 5.0, 1e-12);
}

TEST(MarginalizeKeyframe, LeavesTheLeastEnergyOverItsStates) {
  for (int index = 0; index < 3; ++index) {
    Window window(small_camera());
    for (std::uint32_t i = 0; i < 4; ++i) {
      window.insert(
          make_keyframe(i + 1, nullptr, keyframe_pose(static_cast<int>(i)), {0.02 * i, 0.5 * i}));
    }
    set_random_prior(3, &window);
    displace(1.0, 4, &window);
    WindowConfig config;
    config.prior_a = 2e4;
    config.prior_b = 7.0;

    // The full energy as a quadratic of all displacements, the leaving keyframe last.
    Eigen::PermutationMatrix<Eigen::Dynamic> to_end(32);
    for (int i = 0, to = 0; i < 32; ++i) {
      to_end.indices()[i] = i / 8 == index ? 24 + i % 8 : to++;
    }
    MatX H = window.prior().H;
    VecX b = window.prior().b;
    const Affine& frozen = window[index].frozen_affine;
    H(8 * index + 6, 8 * index + 6) += config.prior_a;
    H(8 * index + 7, 8 * index + 7) += config.prior_b;
    b[8 * index + 6] += config.prior_a * frozen.a;
    b[8 * index + 7] += config.prior_b * frozen.b;
    H = to_end * H * to_end.transpose();
    b = to_end * b;

    const std::uint32_t leaving = window[index].id;
    marginalize_keyframe(config, index, &window);
    ASSERT_EQ(window.size(), 3);
    EXPECT_EQ(window.index_of(leaving), -1);
    ASSERT_EQ(window.prior().b.size(), 24);
    const double offset = least_over_last(H, b, VecX::Zero(24), 8);
    std::mt19937 random(9);
    for (int k = 0; k < 5; ++k) {
      const VecX x = 0.01 * random_vector(&random, 24);
      const double full = least_over_last(H, b, x, 8) - offset;
      EXPECT_NEAR(quadratic(window.prior().H, window.prior().b, x), full, 1e-6 * std::abs(full));
    }
  }
}

/// A window with true geometry, displaced from its linearization points; the priors hold the
/// gauge. The first map keyframe (id 0) is index 1, so that index 0 may leave.
class Marginalization : public ::testing::Test {
 protected:
  Marginalization() : pool_(1), window_(scene_window(4, 9, 10)) {
    config_.folding_weight = 1.0;
    config_.depth_damping = config_.place_damping = 0.0;  // of steps, not of what is folded
    window_[1].id = 0;
    set_random_prior(2, &window_);
    displace(0.7, 3, &window_);
    // No residuals into the oldest: what it sees itself leaves with it.
    for (int h = 1; h < window_.size(); ++h) {
      for (Point& p : window_[h].points) {
        p.residuals[static_cast<std::size_t>(window_[0].slot)] = Residual();
      }
    }
  }

  NormalEquations linearized_system() { return linearized(config_, &window_).system; }

  VecX solve(const NormalEquations& system) {
    return BundleAdjuster(config_, &pool_).solve(window_, system, 0.0, false);
  }

  void marginalize_points_of(int host) {
    std::vector<PointRef> leaving;
    for (Point& p : window_[host].points) leaving.push_back({host, &p});
    ASSERT_GT(leaving.size(), 20U);
    marginalize_points(config_, leaving, &window_, &pool_);
    window_[host].points.clear();
  }

  VecX balanced(const VecX& step) const {
    return BundleAdjuster::state_units(window_).cwiseInverse().cwiseProduct(step);
  }

  WorkerPool pool_;
  WindowConfig config_;
  Window window_;
};

TEST_F(Marginalization, PointsFoldedAwayFromTheLinearizationPointKeepTheSystem) {
  const NormalEquations full = linearized_system();
  const MatX H = full.top - full.schur + window_.prior().H;
  const VecX b =
      full.b_top - full.b_schur + window_.prior().b + window_.prior().H * window_.stacked_x();
  marginalize_points_of(0);
  const NormalEquations rest = linearized_system();
  const MatX H_after = rest.top - rest.schur + window_.prior().H;
  const VecX b_after =
      rest.b_top - rest.b_schur + window_.prior().b + window_.prior().H * window_.stacked_x();
  EXPECT_LT(relative_difference(H_after, H), 1e-5);
  EXPECT_LT(relative_difference(b_after, b), 1e-5);
}

TEST_F(Marginalization, MarginalizingThenSolvingEqualsTheFullSolve) {
  const VecX full = solve(linearized_system());
  marginalize_points_of(0);
  EXPECT_LT(relative_difference(balanced(solve(linearized_system())), balanced(full)), 1e-4);
  marginalize_keyframe(config_, 0, &window_);
  window_.update_geometry();
  const VecX without_oldest = solve(linearized_system());
  ASSERT_EQ(without_oldest.size(), 24);
  EXPECT_LT(relative_difference(balanced(without_oldest), balanced(full.tail(24))), 1e-4);
}

TEST_F(Marginalization, SolutionOfThePriorIsTheSameFromAnywhere) {
  // All residuals folded: the problem is linear, so one step from any displacement leads to the
  // full solution.
  const NormalEquations system = linearized_system();
  const VecX solution = window_.stacked_x() + solve(system);
  for (int h = 0; h + 1 < window_.size(); ++h) marginalize_points_of(h);
  for (const double size : {0.0, 0.5, 2.0}) {
    displace(size, 21, &window_);
    const VecX x = window_.stacked_x() + solve(linearized_system());
    EXPECT_LT(relative_difference(balanced(x), balanced(solution)), 1e-4) << "from " << size;
  }
}

TEST_F(Marginalization, FoldingWeightScalesWhatIsAdded) {
  const MatX before = window_.prior().H;
  Window copy = scene_window(4, 9, 10);
  config_.folding_weight = 0.25;
  marginalize_points_of(0);
  const MatX quarter = window_.prior().H - before;
  Marginalization::config_.folding_weight = 1.0;
  window_ = std::move(copy);
  window_[1].id = 0;
  set_random_prior(2, &window_);
  displace(0.7, 3, &window_);
  marginalize_points_of(0);
  EXPECT_LT(relative_difference(MatX(4.0 * quarter), MatX(window_.prior().H - before)), 1e-9);
}

TEST_F(Marginalization, PriorOfANewKeyframeIsEmpty) {
  const MatX before = window_.prior().H;
  window_.insert(make_keyframe(20, window_.newest().pyramid, keyframe_pose(4)));
  ASSERT_EQ(window_.prior().b.size(), 40);
  EXPECT_EQ(window_.prior().H.topLeftCorner(32, 32), before);
  EXPECT_TRUE(window_.prior().H.rightCols(8).isZero());
}

}  // namespace
}  // namespace sovo
