#include "sovo/vo/lens_equations.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sovo/geometry/linear_solvers.h"

namespace sovo {

namespace {

std::size_t pair_of(int host, int target) {
  return static_cast<std::size_t>(host) * kMaxSlots + static_cast<std::size_t>(target);
}

Mat2 image_gram(const LinearizedResidual& r) {
  Mat2 g;
  g << r.gram[0], r.gram[1], r.gram[1], r.gram[4];
  return g;
}

/// Of the angle between the optical axes of two keyframes [rad].
double squared_turn(const Window& window, int host, int target) {
  const CameraModel& camera = window.camera();
  const Eigen::Vector3f axis =
      window.pair(host, target).RKi * Vec3(camera.cx, camera.cy, 1.0).cast<float>();
  const double angle =
      std::atan2(static_cast<double>(axis.head<2>().norm()), static_cast<double>(axis.z()));
  return angle * angle;
}

/// Part of the balanced Hessian that is added to its diagonal: what single precision leaves of the
/// directions that the residuals do not tell.
constexpr double kUntold = 1e-5;

}  // namespace

Mat2 lens_jacobian(const Window& window, int host, int target, const Point& point) {
  const CameraModel& camera = window.camera();
  const PairGeometry& g = window.pair(host, target);
  const Eigen::Vector3f seen =
      g.RKi * Eigen::Vector3f(point.u, point.v, 1.0F) + g.t * static_cast<float>(point.rho);
  const double iz = 1.0 / static_cast<double>(seen.z());
  const Vec2 x(seen.x() * iz, seen.y() * iz);
  const Eigen::Vector3f off_centre(point.u - static_cast<float>(camera.cx),
                                   point.v - static_cast<float>(camera.cy), 0.0F);
  const Vec3 nearer = (g.RKi * off_centre).cast<double>();
  const Vec2 left = iz * (nearer.head<2>() - x * nearer.z());
  const double squared_host =
      Vec2(off_centre.x() / camera.fx, off_centre.y() / camera.fy).squaredNorm();
  Mat2 out;
  out.col(0) = x - left;
  out.col(1) = x * x.squaredNorm() - left * squared_host;
  return Vec2(camera.fx, camera.fy).asDiagonal() * out;
}

LensEquations::LensEquations(const Window& window)
    : window_(window), pairs_(static_cast<std::size_t>(kMaxSlots) * kMaxSlots) {}

void LensEquations::add(int host, const Point& point, double depth_damping,
                        std::span<const TargetResidual> inliers) {
  std::array<Mat2, kMaxSlots> d;
  double H_rho = depth_damping;
  double b_rho = 0.0;
  Vec2 H_rho_c = Vec2::Zero();
  for (std::size_t i = 0; i < inliers.size(); ++i) {
    const LinearizedResidual& r = *inliers[i].linearized;
    const DepthPart depth = depth_part(r);
    d[i] = lens_jacobian(window_, host, inliers[i].target, point);
    H_rho += static_cast<double>(depth.hessian);
    b_rho += static_cast<double>(depth.gradient);
    H_rho_c += d[i].transpose() * image_gram(r) * Vec2(r.du_rho, r.dv_rho);
  }
  if (!(H_rho > kMinDepthHessian)) return;
  H_ -= H_rho_c * H_rho_c.transpose() / H_rho;
  b_ -= H_rho_c * (b_rho / H_rho);
  for (std::size_t i = 0; i < inliers.size(); ++i) {
    const LinearizedResidual& r = *inliers[i].linearized;
    const Mat2 Gd = image_gram(r) * d[i];
    H_ += d[i].transpose() * Gd;
    b_ += d[i].transpose() * Vec2(r.gram_r[0], r.gram_r[1]);
    Mat82 cross;
    Vec8 gradient;
    Vec8 depth;
    for (Eigen::Index k = 0; k < 8; ++k) {
      const auto j = static_cast<std::size_t>(k);
      depth[k] = r.cross[j];
      if (k >= 6) continue;
      cross.row(k) = r.du[j] * Gd.row(0) + r.dv[j] * Gd.row(1);
      gradient[k] = r.du[j] * r.gram_r[0] + r.dv[j] * r.gram_r[1];
    }
    cross.row(6) = r.gram[2] * d[i].row(0) + r.gram[5] * d[i].row(1);
    cross.row(7) = r.gram[3] * d[i].row(0) + r.gram[6] * d[i].row(1);
    gradient[6] = r.gram_r[2];
    gradient[7] = r.gram_r[3];
    Pair& pair = pairs_[pair_of(host, inliers[i].target)];
    pair.cross += cross - depth * H_rho_c.transpose() / H_rho;
    pair.gradient += gradient - depth * (b_rho / H_rho);
    ++pair.residuals;
  }
}

std::optional<LensEvidence> LensEquations::evidence(const NormalEquations& system) const {
  const int n = window_.size();
  // J_x^T [J_c, r] of the states.
  MatX right = MatX::Zero(Eigen::Index{8} * n, 3);
  const double mean_rho = window_.mean_inverse_depth();
  double squared_turns = 0.0;
  double squared_ways = 0.0;
  int residuals = 0;
  for (int h = 0; h < n; ++h) {
    for (int t = 0; t < n; ++t) {
      if (h == t) continue;
      const Pair& pair = pairs_[pair_of(h, t)];
      squared_turns += pair.residuals * squared_turn(window_, h, t);
      squared_ways += pair.residuals * std::pow(mean_rho * window_.pair(h, t).distance, 2);
      residuals += pair.residuals;
      Eigen::Matrix<double, 8, 3> relative;
      relative << pair.cross, pair.gradient;
      right.middleRows<8>(Eigen::Index{8} * t) += relative;
      right.middleRows<8>(Eigen::Index{8} * h) +=
          window_.pair(h, t).adjoint_host.transpose() * relative;
    }
  }
  MatX H = system.top - system.schur;
  const VecX balance =
      H.diagonal().unaryExpr([](double v) { return v > 0.0 ? 1.0 / std::sqrt(v) : 0.0; });
  H = balance.asDiagonal() * H * balance.asDiagonal();
  H.diagonal().array() += kUntold;
  right = balance.asDiagonal() * right;
  const MatX solved = solve_symmetric_columns(H, right);
  LensEvidence out;
  out.turn = std::sqrt(squared_turns / std::max(1, residuals));
  out.way = std::sqrt(squared_ways / std::max(1, residuals));
  out.H = H_ - right.leftCols<2>().transpose() * solved.leftCols<2>();
  out.b = b_ - right.leftCols<2>().transpose() * solved.col(2);
  const bool tells = out.H.allFinite() && out.b.allFinite() && out.H(0, 0) > 0.0 &&
                     out.H(1, 1) > 0.0 && out.H.determinant() > 0.0;
  return tells ? std::optional(out) : std::nullopt;
}

}  // namespace sovo
