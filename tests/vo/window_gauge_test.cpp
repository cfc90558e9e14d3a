#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "support/numeric.h"
#include "vo/window_test_support.h"

namespace sovo {
namespace {

using namespace test;

constexpr int kGaugeKeyframes = 5;

WindowConfig without_priors() {
  WindowConfig config;
  config.prior_a = config.prior_b = config.depth_damping = config.place_damping = 0.0;
  config.resample_px = 0.0;  // the window is moved and scaled under the problem
  return config;
}

/// A window that is linearized at true poses and depths, all keyframes free.
class WindowGauge : public ::testing::Test {
 protected:
  WindowGauge()
      : pool_(1),
        adjuster_(without_priors(), &pool_),
        window_(scene_window(kGaugeKeyframes, 6, 1)),
        problem_(without_priors(), collect_points(&window_), &window_, &pool_) {}

  NormalEquations linearized_system() {
    WindowLinearization linearized;
    problem_.linearize(problem_.stored(), {}, &linearized);
    problem_.write_back(linearized);
    energy_ = linearized.energy;
    return linearized.system;
  }

  /// The reduced normal matrix in comparable units.
  MatX reduced(const NormalEquations& system) const {
    const VecX units = BundleAdjuster::state_units(window_);
    return units.asDiagonal() * (system.top - system.schur) * units.asDiagonal();
  }

  WorkerPool pool_;
  BundleAdjuster adjuster_;
  Window window_;
  PhotometricProblem problem_;
  double energy_ = 0.0;
};

/// Rows and columns of poses alone.
MatX pose_block(const MatX& H) {
  const Eigen::Index n = H.rows() / 8;
  MatX out(6 * n, 6 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      out.block<6, 6>(6 * i, 6 * j) = H.block<6, 6>(8 * i, 8 * j);
    }
  }
  return out;
}

/// How many eigenvalues of a matrix vanish; checks that there is a clear gap after them.
Eigen::Index nullity(const MatX& H, Eigen::Index expected) {
  VecX e = Eigen::SelfAdjointEigenSolver<MatX>(H).eigenvalues().cwiseAbs();
  std::sort(e.begin(), e.end());
  EXPECT_GT(e[expected], 1e4 * e[expected - 1]) << "no gap: " << e.head(expected + 3).transpose();
  EXPECT_LT(e[expected - 1], 1e-6 * e.maxCoeff());
  return (e.array() < std::sqrt(e[expected] * e[expected - 1])).count();
}

TEST_F(WindowGauge, MotionAndScaleOfTheWorldAreUnobservable) {
  const MatX H = reduced(linearized_system());
  ASSERT_GT(problem_.points().size(), 300U);
  const MatX basis = BundleAdjuster::gauge_basis(window_, BundleAdjuster::state_units(window_));
  ASSERT_EQ(basis.cols(), 7);
  for (Eigen::Index c = 0; c < basis.cols(); ++c) {
    const VecX n = basis.col(c);
    EXPECT_LT((H * n).norm() / (H.norm() * n.norm()), 1e-6) << "direction " << c;
  }
}

TEST_F(WindowGauge, NullspaceHasSevenDirectionsAndTwoOfBrightness) {
  const MatX H = reduced(linearized_system());
  EXPECT_EQ(nullity(pose_block(H), 7), 7);
  // A gain and a bias of the whole scene are the other two; the frame priors hold them.
  EXPECT_EQ(nullity(H, 9), 9);
}

TEST_F(WindowGauge, NullspaceStaysAwayFromTheLinearizationPoint) {
  // First estimates: without them, displaced poses would seem to say something about the gauge.
  displace(1.0, 5, &window_);
  const MatX H = reduced(linearized_system());
  EXPECT_EQ(nullity(pose_block(H), 7), 7);
  const MatX basis = BundleAdjuster::gauge_basis(window_, BundleAdjuster::state_units(window_));
  EXPECT_LT((H * basis).norm() / H.norm(), 1e-6);
}

TEST_F(WindowGauge, StepWithoutGaugeIsOrthogonalToIt) {
  displace(1.0, 6, &window_);
  const NormalEquations system = linearized_system();
  const VecX units = BundleAdjuster::state_units(window_);
  const MatX basis = BundleAdjuster::gauge_basis(window_, units);
  const VecX step = units.cwiseInverse().cwiseProduct(adjuster_.solve(window_, system, 1e-3, true));
  EXPECT_GT(step.norm(), 1e-4);
  EXPECT_LT((basis.transpose() * step).norm(), 1e-9 * step.norm() + 1e-12);
}

/// The covariance of the newest pose as seen from the one before, from the pseudo-inverse.
Mat6 by_pseudo_inverse(const Window& window, const MatX& H, const VecX& units) {
  const Eigen::SelfAdjointEigenSolver<MatX> eigen(H);
  MatX inverse = MatX::Zero(H.rows(), H.cols());
  for (Eigen::Index i = 7; i < H.rows(); ++i) {
    const VecX v = eigen.eigenvectors().col(i);
    inverse += v * v.transpose() / eigen.eigenvalues()[i];
  }
  const Eigen::Index n = H.rows();
  MatX J = MatX::Zero(6, n);
  const SE3 T_newest_before =
      window.newest().T_camera_world * window[window.size() - 2].T_world_camera();
  J.block<6, 6>(0, n - 8).setIdentity();
  J.block<6, 6>(0, n - 16) = -T_newest_before.adjoint();
  J = J * units.asDiagonal();
  return J * inverse * J.transpose();
}

TEST_F(WindowGauge, NewestPoseAsSeenFromTheOneBeforeHasTheCovarianceOfThePseudoInverse) {
  const NormalEquations system = linearized_system();
  const BundleAdjuster adjuster(WindowConfig(), &pool_);
  const VecX units = BundleAdjuster::state_units(window_);
  MatX H = system.top - system.schur;
  for (int i = 0; i < window_.size(); ++i) {
    H.diagonal().segment<8>(8 * i) += frame_prior(window_[i], WindowConfig()).weight;
  }
  const Mat6 expected =
      by_pseudo_inverse(window_, units.asDiagonal() * H * units.asDiagonal(), units);
  const Mat6 found = adjuster.newest_covariance(window_, system);
  const Mat3 expected_rotation = expected.bottomRightCorner<3, 3>();
  const Mat3 found_rotation = found.bottomRightCorner<3, 3>();
  EXPECT_TRUE(found_rotation.isApprox(expected_rotation, 1e-4));
  // Along the step lies its scale, which the one holds and the other shares out.
  const SE3 T_newest_before =
      window_.newest().T_camera_world * window_[window_.size() - 2].T_world_camera();
  const Vec3 along = T_newest_before.translation().normalized();
  const Mat3 across = Mat3::Identity() - along * along.transpose();
  const Mat3 found_across = across * found.topLeftCorner<3, 3>() * across;
  const Mat3 expected_across = across * expected.topLeftCorner<3, 3>() * across;
  EXPECT_GT(expected_across.norm(), 0.0);
  EXPECT_TRUE(found_across.isApprox(expected_across, 1e-4)) << found_across << "\n\n"
                                                            << expected_across;
}

TEST_F(WindowGauge, CovarianceOfTheNewestPoseScalesWithTheWorld) {
  const BundleAdjuster adjuster(WindowConfig(), &pool_);
  Mat6 before = adjuster.newest_covariance(window_, linearized_system());
  window_.apply_similarity(3.0);
  before.topRows<3>() *= 3.0;
  before.leftCols<3>() *= 3.0;
  const Mat6 after = adjuster.newest_covariance(window_, linearized_system());
  EXPECT_TRUE(after.isApprox(before, 1e-3)) << after << "\n\n" << before;
}

class Similarity : public WindowGauge, public ::testing::WithParamInterface<double> {};

TEST_P(Similarity, LeavesEnergyPriorAndStepUnchanged) {
  const double scale = GetParam();
  for (const double displacement : {0.0, 1.0}) {
    displace(displacement, 7, &window_);
    set_random_prior(8, &window_);
    const NormalEquations before = linearized_system();
    const double energy = energy_;
    const double prior = adjuster_.prior_energy(window_);
    const VecX step = adjuster_.solve(window_, before, 1e-4, true);
    const Vec3 centre = window_.newest().T_world_camera().translation();
    const Vec3 oldest = window_[0].T_world_camera().translation();
    const Point point = window_[0].points[0];

    window_.apply_similarity(scale);
    EXPECT_LT((window_.newest().T_world_camera().translation() - centre).norm(), 1e-9);
    const Vec3 moved = window_[0].T_world_camera().translation();
    EXPECT_LT((moved - (centre + scale * (oldest - centre))).norm(), 1e-9 * scale);
    const Point& scaled = window_[0].points[0];
    EXPECT_NEAR(scaled.rho * scale, point.rho, 1e-12);
    EXPECT_NEAR(scaled.hessian * std::pow(scaled.rho, 2) / (point.hessian * std::pow(point.rho, 2)),
                1.0, 1e-9)
        << "information on the log-depth";
    EXPECT_NEAR(scaled.gradient * scaled.rho, point.gradient * point.rho,
                1e-9 * std::abs(point.gradient * point.rho));

    const NormalEquations after = linearized_system();
    EXPECT_NEAR(energy_, energy, 1e-5 * energy);
    EXPECT_NEAR(adjuster_.prior_energy(window_), prior, 1e-9 * std::abs(prior));
    EXPECT_EQ(after.residuals, before.residuals);
    VecX expected = step;
    for (int i = 0; i < window_.size(); ++i) expected.segment<3>(8 * i) *= scale;
    const VecX units = BundleAdjuster::state_units(window_).cwiseInverse();
    EXPECT_LT(
        relative_difference(units.cwiseProduct(adjuster_.solve(window_, after, 1e-4, true)).eval(),
                            units.cwiseProduct(expected).eval()),
        2e-3);
    window_.apply_similarity(1.0 / scale);
  }
}

INSTANTIATE_TEST_SUITE_P(Scales, Similarity, ::testing::Values(0.2, 0.97, 1.05, 7.0));

TEST_F(WindowGauge, HoldingAKeyframeMovesTheWorldAlone) {
  displace(1.0, 7, &window_);
  set_random_prior(8, &window_);
  const NormalEquations before = linearized_system();
  const double energy = energy_;
  const double prior = adjuster_.prior_energy(window_);
  const VecX step = adjuster_.solve(window_, before, 1e-4, true);
  const SE3 T_newest_oldest = window_.newest().T_camera_world * window_[0].T_world_camera();

  const SE3 place(SO3::exp(Vec3(0.3, -0.2, 0.5)), Vec3(4.0, -3.0, 2.0));
  window_.hold(0, place);
  EXPECT_LT((window_[0].T_world_camera().inverse() * place).log().norm(), 1e-12);
  const SE3 seen = window_.newest().T_camera_world * window_[0].T_world_camera();
  EXPECT_LT((seen.inverse() * T_newest_oldest).log().norm(), 1e-12);

  const NormalEquations after = linearized_system();
  EXPECT_NEAR(energy_, energy, 1e-5 * energy);
  EXPECT_NEAR(adjuster_.prior_energy(window_), prior, 1e-9 * std::abs(prior));
  const VecX units = BundleAdjuster::state_units(window_).cwiseInverse();
  EXPECT_LT(
      relative_difference(units.cwiseProduct(adjuster_.solve(window_, after, 1e-4, true)).eval(),
                          units.cwiseProduct(step).eval()),
      2e-3);
}

TEST_F(WindowGauge, TheSteadiestKeyframeIsOneThatTheOthersStayWith) {
  ASSERT_GE(window_.size(), 4);
  const std::vector<SE3> before = window_.poses();
  const auto moved = [](double size) {
    Vec8 x = Vec8::Zero();
    x.head<3>() = size * Vec3(1.0, -2.0, 0.5);
    return x;
  };
  window_[0].set_x(moved(0.3));
  window_.newest().set_x(moved(2.0));
  // The whole world moved along changes nothing.
  window_.hold(1, SE3(SO3::exp(Vec3(0.3, -0.2, 0.5)), Vec3(4.0, -3.0, 2.0)));
  const int held = window_.steadiest(before);
  window_.hold(held, before[static_cast<std::size_t>(held)]);
  for (int i = 1; i + 1 < window_.size(); ++i) {
    const SE3 off = window_[i].T_world_camera() * before[static_cast<std::size_t>(i)].inverse();
    EXPECT_LT(off.log().norm(), 1e-9) << i;
  }
}

TEST_F(WindowGauge, ThePlaceToHoldIsThatOfGreatWeight) {
  ASSERT_EQ(window_.size(), 5);
  const std::vector<SE3> before = window_.poses();
  for (int i = 0; i < 3; ++i) {
    Vec8 x = Vec8::Zero();
    x.head<3>() = Vec3(0.3, 0.1, -0.2);
    window_[i].set_x(x);
  }
  EXPECT_LT(window_.steadiest_place(before, {1.0, 1.0, 1.0, 1.0}), 3) << "most have moved";
  EXPECT_EQ(window_.steadiest_place(before, {1.0, 1.0, 1.0, 4.0}), 3);
  EXPECT_LT(window_.steadiest_place(before, {0.1, 4.0, 0.1, 4.0}), 3);
}

/// Total variance of a keyframe's place, from the whole system with the newest keyframe and the
/// scale about it held by weights.
double variance_of_place(const Window& window, const NormalEquations& system, int keyframe) {
  constexpr double kHeld = 1e14;
  const int newest = window.size() - 1;
  MatX H = system.top - system.schur + window.prior().H;
  H.diagonal().segment<6>(8 * newest).array() += kHeld;
  VecX scale = VecX::Zero(H.rows());
  const Vec3 centre = window[newest].T_world_camera().translation();
  for (int i = 0; i < newest; ++i) {
    scale.segment<3>(8 * i) = window[i].frozen_T_camera_world * centre;
  }
  H += kHeld * scale * scale.transpose();
  const Eigen::SelfAdjointEigenSolver<MatX> eigen(H);
  const MatX covariance = eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() *
                          eigen.eigenvectors().transpose();
  return covariance.block<3, 3>(8 * keyframe, 8 * keyframe).trace();
}

TEST_F(WindowGauge, InformationOnPlacesIsThatOfTheWholeSystem) {
  const NormalEquations system = linearized_system();
  const std::vector<double> information = adjuster_.place_information(window_, system);
  ASSERT_EQ(information.size(), 4U);
  for (int i = 0; i < 4; ++i) {
    const double expected = 1.0 / variance_of_place(window_, system, i);
    EXPECT_NEAR(information[static_cast<std::size_t>(i)], expected, 0.02 * expected) << i;
  }
}

TEST_F(WindowGauge, OfTheFirstKeyframeOnlyWhatIsSeenTellsItsPlace) {
  Window first = scene_window(kGaugeKeyframes, 6, 0);
  const NormalEquations system = linearized_system();
  const std::vector<double> as_world = adjuster_.place_information(first, system);
  const std::vector<double> later = adjuster_.place_information(window_, system);
  for (std::size_t i = 0; i < later.size(); ++i) {
    EXPECT_NEAR(as_world[i], later[i], 0.02 * later[i]) << i;
  }
}

TEST_F(WindowGauge, SimilarityScalesImmatureIntervals) {
  ImmaturePoint p;
  p.rho_min = 0.2F;
  p.rho_max = 0.5F;
  p.static_information = 30.0F;
  window_[1].immature = {p, ImmaturePoint()};
  window_.apply_similarity(2.0);
  EXPECT_FLOAT_EQ(window_[1].immature[0].rho_min, 0.1F);
  EXPECT_FLOAT_EQ(window_[1].immature[0].rho_max, 0.25F);
  EXPECT_FLOAT_EQ(window_[1].immature[0].static_information, 120.0F);
  EXPECT_TRUE(std::isnan(window_[1].immature[1].rho_max));
}

TEST_F(WindowGauge, OtherThanASimilarityChangesTheEnergy) {
  // What the tests above would miss if the energy did not depend on lengths at all.
  linearized_system();
  const double energy = energy_;
  for (const PointRef& ref : problem_.points()) ref.point->rho *= 1.05;
  linearized_system();
  EXPECT_GT(energy_, 1.2 * energy);
}

}  // namespace
}  // namespace sovo
