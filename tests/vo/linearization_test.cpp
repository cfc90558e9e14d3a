#include "sovo/vo/linearization.h"

#include <gtest/gtest.h>

#include "support/numeric.h"
#include "vo/window_test_support.h"

namespace sovo {
namespace {

using namespace test;

using Vec9 = Eigen::Matrix<double, 9, 1>;
using Mat9 = Eigen::Matrix<double, 9, 9>;
using Mat89 = Eigen::Matrix<double, 8, 9>;

/// Two keyframes that see smooth images, and one point; the exposures are known.
class WindowJacobian : public ::testing::Test {
 protected:
  WindowJacobian() : window_(make_camera(320, 240, 260, 255, 158.7, 121.3)) {
    const CameraModel& camera = window_.camera();
    add(0, SE3(), {0.05, 3.0}, 0.010, WaveImage{0.2}.sampled(camera.width, camera.height));
    add(1, SE3(SO3::exp(Vec3(0.03, -0.05, 0.04)), Vec3(0.21, -0.08, 0.12)), {-0.04, -2.0}, 0.012,
        image_.sampled(camera.width, camera.height));
    window_[0].points.push_back(make_point(window_[0].image(), 140, 96, 0.45));
    point().residuals[slot()].state = ResidualState::kIn;
    window_.update_geometry();
  }

  void add(std::uint32_t id, const SE3& pose, const Affine& affine, double exposure, ImageF image) {
    window_.insert(make_keyframe(id, pyramid_of(std::move(image)), pose, affine)).exposure_s =
        exposure;
  }

  Point& point() { return window_[0].points[0]; }
  std::size_t slot() const { return static_cast<std::size_t>(window_[1].slot); }
  Residual& residual() { return point().residuals[slot()]; }
  float linearize_any() {
    return linearize(window_, config_, 0, 1, point(), residual(), &linearized_);
  }
  void linearize_now() {
    linearize_any();
    ASSERT_EQ(linearized_.state, ResidualState::kIn);
  }

  /// Pixel in the target for relative displacement (6), a, b and inverse depth.
  Vec2 project(double u, double v, const Vec9& state) const {
    const CameraModel& c = window_.camera();
    const SE3 T = SE3::exp(state.head<6>()) * window_[1].frozen_T_camera_world *
                  window_[0].frozen_T_camera_world.inverse();
    const Vec3 ray((u - c.cx) / c.fx, (v - c.cy) / c.fy, 1.0);
    const Vec3& moved = T.translation();
    const Vec3 t = (1.0 + shift_.share) * moved +
                   shift_.along.cast<double>().dot(moved) * shift_.across.cast<double>() +
                   shift_.fixed.cast<double>();
    const Vec3 p = T.rotation_matrix() * ray + t * state[8];
    return {c.fx * p.x() / p.z() + c.cx, c.fy * p.y() / p.z() + c.cy};
  }

  BrightnessTransfer transfer(const Vec9& state) const {
    return brightness_transfer(
        window_[0].affine, window_[0].exposure_s,
        {window_[1].frozen_affine.a + state[6], window_[1].frozen_affine.b + state[7]},
        window_[1].exposure_s);
  }

  Vec9 here() {
    Vec9 state = Vec9::Zero();
    state[8] = point().rho;
    return state;
  }

  /// Residuals of the pattern in the analytic image. `rigid`: the pattern moves with its centre.
  Eigen::Matrix<double, 8, 1> residuals(const Vec9& state, bool rigid) {
    const BrightnessTransfer t = transfer(state);
    const Vec2 moved = project(point().u, point().v, state) - project(point().u, point().v, here());
    Eigen::Matrix<double, 8, 1> r;
    for (std::size_t i = 0; i < kPatternSize; ++i) {
      const double u = point().u + kPattern[i].x;
      const double v = point().v + kPattern[i].y;
      const Vec2 at = rigid ? Vec2(project(u, v, here()) + moved) : project(u, v, state);
      r[static_cast<Eigen::Index>(i)] =
          image_(at.x(), at.y()) - (t.gain * point().colour[i] + t.bias);
    }
    return r;
  }

  /// Weights (Huber's included) of the pattern, from the analytic image.
  Vec8 weights() {
    const Vec8 r = residuals(here(), true);
    const double c2 = config_.gradient_constant * config_.gradient_constant;
    Vec8 w;
    for (std::size_t i = 0; i < kPatternSize; ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      const Vec2 at = project(point().u + kPattern[i].x, point().v + kPattern[i].y, here());
      const auto value = [&](const Vec2& p) {
        return Eigen::Matrix<double, 1, 1>(image_(p.x(), p.y()));
      };
      const double g2 = central_differences<1, 2>(value, at, 1e-4).squaredNorm();
      const double huber = std::min(1.0, config_.huber / std::abs(r[k]));
      w[k] = std::sqrt(huber) * 0.5 * (std::sqrt(c2 / (c2 + g2)) + point().weight[i]);
    }
    return w;
  }

  /// Weighted normal equations (pose, a, b, inverse depth) by central differences.
  void numeric_normal_equations(bool rigid, Mat9* H, Vec9* b) {
    const auto f = [&](const Vec9& s) { return residuals(s, rigid); };
    const Mat89 J = central_differences<8, 9>(f, here(), 1e-5);
    const Vec8 squared = weights().cwiseAbs2();
    *H = J.transpose() * squared.asDiagonal() * J;
    *b = J.transpose() * squared.cwiseProduct(residuals(here(), rigid));
  }

  /// The same from the linearization under test.
  void normal_equations(Mat9* H, Vec9* b) {
    const DepthPart depth = depth_part(linearized_);
    const double hessian = static_cast<double>(depth.hessian);
    const double gradient = static_cast<double>(depth.gradient);
    HostSums sums;
    sums.clear(2);
    const std::vector<TargetResidual> residuals = {{1, &linearized_}};
    sums.add(residuals, hessian, gradient);
    for (std::size_t i = 0; i < 8; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      for (std::size_t j = i; j < 8; ++j) {
        const auto column = static_cast<Eigen::Index>(j);
        (*H)(row, column) = (*H)(column, row) = sums.top(1).H[i][j];
      }
      (*b)[row] = sums.top(1).b[i];
      (*H)(row, 8) = (*H)(8, row) = linearized_.cross[i];
    }
    (*H)(8, 8) = hessian;
    (*b)[8] = gradient;
  }

  /// The images are read out row after row while the camera moves on.
  void roll() {
    const double middle = 0.5 * (window_.camera().height - 1);
    window_[0].shift = {.per_row = Vec3(2e-4, 1e-4, 5e-4), .middle = middle};
    window_[1].shift = {.per_row = Vec3(-1e-4, 2e-4, 6e-4), .middle = middle};
    window_.update_geometry();
    const Vec2 seen = project(point().u, point().v, here());
    shift_ = window_.pair(0, 1).shift.at({point().u, point().v}, seen.cast<float>());
  }

  /// The camera is behind a port.
  void dive() {
    CameraModel camera = window_.camera();
    camera.port = {.distance = 0.3, .thickness = 0.05, .normal = {0.02, 0.01, 0.9997}};
    window_[0].shift.axial = window_[1].shift.axial = AxialRays::of(camera);
    window_.update_geometry();
    const Vec2 seen = project(point().u, point().v, here());
    shift_ = window_.pair(0, 1).shift.at({point().u, point().v}, seen.cast<float>());
  }

  /// Where the point is seen and how that changes are what central differences say.
  void expect_shifted_geometry() {
    linearize_now();
    const auto f = [&](const Vec9& s) { return project(point().u, point().v, s); };
    const Eigen::Matrix<double, 2, 9> J = central_differences<2, 9>(f, here());
    const LinearizedResidual& r = linearized_;
    // A target that turns takes what is added along or leaves it: that is not told apart.
    const double added = double{shift_.across.norm()} + double{shift_.fixed.norm()};
    const double turned = window_.camera().fx * point().rho * added;
    for (std::size_t k = 0; k < 6; ++k) {
      const auto c = static_cast<Eigen::Index>(k);
      const double tolerance = 3e-4 * J.col(c).norm() + (k < 3 ? 0.0 : turned);
      EXPECT_NEAR(r.du[k], J(0, c), tolerance) << "state " << k;
      EXPECT_NEAR(r.dv[k], J(1, c), tolerance) << "state " << k;
    }
    EXPECT_NEAR(r.du_rho, J(0, 8), 3e-4 * J.col(8).norm());
    EXPECT_NEAR(r.dv_rho, J(1, 8), 3e-4 * J.col(8).norm());
    EXPECT_NEAR(r.centre_u, f(here()).x(), 1e-2);
    EXPECT_NEAR(r.centre_v, f(here()).y(), 1e-2);
  }

  WaveImage image_{0.5};
  PairViewShift::Displacement shift_;
  WindowConfig config_;
  Window window_;
  LinearizedResidual linearized_;
};

/// H with its unknowns in units that make them comparable.
Mat9 balanced(const Mat9& H, const Mat9& reference) {
  const Vec9 s = reference.diagonal().cwiseSqrt().cwiseInverse();
  return s.asDiagonal() * H * s.asDiagonal();
}

/// A host of weak texture has its own part of Huber's threshold, in whatever it is seen.
TEST_F(WindowJacobian, ThePatternHasItsHostsShareOfHubersThreshold) {
  config_.huber = 4.0;
  linearize_any();
  const LinearizedResidual usual = linearized_;
  window_[1].huber_share = 0.25;  // of the target: nothing
  linearize_any();
  EXPECT_EQ(linearized_.raw_energy, usual.raw_energy);
  window_[0].huber_share = 0.25;
  linearize_any();
  const LinearizedResidual low = linearized_;
  EXPECT_LT(low.raw_energy, 0.8F * usual.raw_energy) << "the test needs residuals beyond it";
  window_[0].huber_share = 1.0;
  config_.huber = 1.0;
  linearize_any();
  EXPECT_EQ(linearized_.raw_energy, low.raw_energy);
  EXPECT_EQ(linearized_.gram, low.gram);
  EXPECT_EQ(linearized_.gram_r, low.gram_r);
}

TEST_F(WindowJacobian, GeometryAgreesWithCentralDifferencesAtTheCentrePixel) {
  linearize_now();
  const auto f = [&](const Vec9& s) { return project(point().u, point().v, s); };
  const Eigen::Matrix<double, 2, 9> J = central_differences<2, 9>(f, here());
  const LinearizedResidual& r = linearized_;
  for (std::size_t k = 0; k < 6; ++k) {
    const auto c = static_cast<Eigen::Index>(k);
    EXPECT_NEAR(r.du[k], J(0, c), 1e-4 * J.col(c).norm()) << "state " << k;
    EXPECT_NEAR(r.dv[k], J(1, c), 1e-4 * J.col(c).norm()) << "state " << k;
  }
  EXPECT_NEAR(r.du_rho, J(0, 8), 1e-4 * J.col(8).norm());
  EXPECT_NEAR(r.dv_rho, J(1, 8), 1e-4 * J.col(8).norm());
  EXPECT_NEAR(r.centre_u, f(here()).x(), 1e-3);
  EXPECT_NEAR(r.centre_v, f(here()).y(), 1e-3);
}

TEST_F(WindowJacobian, GeometryOfARollingShutterAgreesWithCentralDifferences) {
  const Vec2 at_once = project(point().u, point().v, here());
  roll();
  EXPECT_GT((project(point().u, point().v, here()) - at_once).norm(), 0.5)
      << "or the rows do nothing";
  expect_shifted_geometry();
}

TEST_F(WindowJacobian, GeometryBehindAPortAgreesWithCentralDifferences) {
  const Vec2 central = project(point().u, point().v, here());
  dive();
  EXPECT_GT((project(point().u, point().v, here()) - central).norm(), 0.5)
      << "or the port does nothing";
  expect_shifted_geometry();
}

TEST_F(WindowJacobian, APortStaysInMetres) {
  dive();
  const Vec3 offset = window_[0].shift.at(double{point().u}, double{point().v});
  window_.apply_similarity(1.9);
  EXPECT_EQ(window_[0].shift.at(double{point().u}, double{point().v}), offset);
}

TEST_F(WindowJacobian, RowsGrowWithTheMap) {
  roll();
  linearize_now();
  const LinearizedResidual before = linearized_;
  window_.apply_similarity(1.9);
  window_.update_geometry();
  linearize_now();
  EXPECT_NEAR(linearized_.centre_u, before.centre_u, 1e-3);
  EXPECT_NEAR(linearized_.centre_v, before.centre_v, 1e-3);
}

TEST_F(WindowJacobian, WholeLinearizationAgreesWithCentralDifferences) {
  linearize_now();
  Mat9 H, numeric_H;
  Vec9 b, numeric_b;
  normal_equations(&H, &b);
  numeric_normal_equations(true, &numeric_H, &numeric_b);
  EXPECT_LT(relative_difference(balanced(H, numeric_H), balanced(numeric_H, numeric_H)), 1e-3);
  const Vec9 s = numeric_H.diagonal().cwiseSqrt().cwiseInverse();
  EXPECT_LT(relative_difference(s.cwiseProduct(b), s.cwiseProduct(numeric_b)), 1e-3);
  const double squared = weights().cwiseProduct(residuals(here(), true)).squaredNorm();
  EXPECT_NEAR(linearized_.rr, squared, 1e-3 * squared);
}

TEST_F(WindowJacobian, PatternApproximationIsSmall) {
  // The centre's Jacobian stands for all eight pixels (DSO, Sec. 2.4).
  linearize_now();
  Mat9 H, numeric_H;
  Vec9 b, numeric_b;
  normal_equations(&H, &b);
  numeric_normal_equations(false, &numeric_H, &numeric_b);
  const double error = relative_difference(balanced(H, numeric_H), balanced(numeric_H, numeric_H));
  RecordProperty("pattern_approximation", std::to_string(error));
  std::cout << "centre Jacobian for the whole pattern: normal matrix off by " << 100.0 * error
            << " %\n";
  EXPECT_GT(error, 1e-5) << "the exact Jacobian would not need this measurement";
  EXPECT_LT(error, 0.05);
}

TEST_F(WindowJacobian, HostAndTargetDisplacementsEnterAsTheAdjointSays) {
  const auto relative = [&](const Eigen::Matrix<double, 16, 1>& x) {
    window_[0].set_x(x.head<8>());
    window_[1].set_x(x.tail<8>());
    const SE3 T0 = window_[1].frozen_T_camera_world * window_[0].frozen_T_camera_world.inverse();
    const SE3 T = window_[1].T_camera_world * window_[0].T_camera_world.inverse();
    const BrightnessTransfer t = brightness_transfer(window_[0].affine, window_[0].exposure_s,
                                                     window_[1].affine, window_[1].exposure_s);
    const BrightnessTransfer t0 =
        brightness_transfer(window_[0].frozen_affine, window_[0].exposure_s,
                            window_[1].frozen_affine, window_[1].exposure_s);
    Vec8 out;
    // The residual's derivative by the log-gain is -gain (I_host - b_host): what is left of the
    // bias is b_target - gain * b_host with the gain held.
    out << (T * T0.inverse()).log(), std::log(t.gain / t0.gain),
        window_[1].affine.b - t0.gain * window_[0].affine.b;
    return out;
  };
  const Eigen::Matrix<double, 16, 1> zero = Eigen::Matrix<double, 16, 1>::Zero();
  const Eigen::Matrix<double, 8, 16> J = central_differences<8, 16>(relative, zero);
  EXPECT_LT(relative_difference(Mat8(window_.pair(0, 1).adjoint_host), Mat8(J.leftCols<8>())),
            1e-6);
  EXPECT_LT(relative_difference(Mat8(Mat8::Identity()), Mat8(J.rightCols<8>())), 1e-6);
}

TEST_F(WindowJacobian, GeometryStaysAtTheFirstEstimate) {
  linearize_now();
  const LinearizedResidual before = linearized_;
  Vec8 x;
  x << 0.01, -0.02, 0.015, 0.004, -0.003, 0.002, 0.03, 1.0;
  window_[1].set_x(x);
  window_.update_geometry();
  linearize_now();
  EXPECT_EQ(linearized_.du, before.du);
  EXPECT_EQ(linearized_.dv, before.dv);
  EXPECT_EQ(linearized_.du_rho, before.du_rho);
  EXPECT_NE(linearized_.centre_u, before.centre_u) << "the residual itself is the present one";
  EXPECT_NE(linearized_.rr, before.rr);
}

TEST_F(WindowJacobian, ShiftedResidualIsThatOfTheLinearModel) {
  linearize_now();
  Mat9 H;
  Vec9 b, shifted;
  normal_equations(&H, &b);
  Vec9 x;
  x << 0.002, -0.003, 0.001, 0.001, 0.002, -0.001, 0.02, 0.4, 0.0;
  shift_residual(x.head<8>(), &linearized_);
  normal_equations(&H, &shifted);
  const Vec9 s = H.diagonal().cwiseSqrt().cwiseInverse();
  EXPECT_LT(relative_difference(s.cwiseProduct(shifted), s.cwiseProduct(Vec9(b - H * x))), 1e-4);
}

TEST_F(WindowJacobian, PointThatLeavesTheImageStaysOutOfView) {
  point().u = 5.0F;
  point().rho = 0.4;
  window_[1].set_x(Vec8::Unit(0) * -1.5);
  window_.update_geometry();
  residual().energy = 7.0F;
  EXPECT_EQ(linearize_any(), 7.0F);
  EXPECT_EQ(linearized_.state, ResidualState::kOutOfView);
  residual().state = linearized_.state;
  window_[1].set_x(Vec8::Zero());
  window_.update_geometry();
  linearize_any();
  EXPECT_EQ(linearized_.state, ResidualState::kOutOfView);
}

TEST_F(WindowJacobian, ResidualAboveTheThresholdIsAnOutlierThatCountsTheThreshold) {
  window_[0].outlier_threshold = window_[1].outlier_threshold = 1e-3;
  EXPECT_FLOAT_EQ(linearize_any(), 1e-3F);
  EXPECT_EQ(linearized_.state, ResidualState::kOutlier);
  EXPECT_GT(linearized_.raw_energy, 1e-3F);
}

}  // namespace
}  // namespace sovo
