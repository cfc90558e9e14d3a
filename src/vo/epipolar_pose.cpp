#include "sovo/vo/epipolar_pose.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "sovo/geometry/linear_solvers.h"

namespace sovo {
namespace {

using Vec5 = Eigen::Matrix<double, 5, 1>;
using Mat5 = Eigen::Matrix<double, 5, 5>;
using Mat32 = Eigen::Matrix<double, 3, 2>;

/// Two unit vectors that span the plane across t.
Mat32 tangent_basis(const Vec3& t) {
  const Vec3 axis = std::abs(t.x()) < 0.6 ? Vec3::UnitX() : Vec3::UnitY();
  Mat32 basis;
  basis.col(0) = t.cross(axis).normalized();
  basis.col(1) = t.cross(basis.col(0));
  return basis;
}

/// Sampson distance of x1^T E x0 = 0 in units of the image plane.
double sampson(const Correspondence& m, const Mat3& E) {
  const Vec3 x0(m.x0, m.y0, 1.0), x1(m.x1, m.y1, 1.0);
  const Vec3 a = E * x0;
  const Vec3 b = E.transpose() * x1;
  return x1.dot(a) / std::sqrt(a.head<2>().squaredNorm() + b.head<2>().squaredNorm() + 1e-18);
}

Mat3 essential(const SE3& T) { return hat(T.translation()) * T.rotation_matrix(); }

/// Residual and its derivative to (rotation, two tangents of the translation), the Sampson
/// denominator held: d(x1 . (t x R x0)) = w . (R x0 x (x1 x t)) + dt . (R x0 x x1).
double linearize(const Correspondence& m, const SE3& T, const Mat3& R, const Mat3& E,
                 const Mat32& tangents, Vec5* J) {
  const Vec3 x0(m.x0, m.y0, 1.0), x1(m.x1, m.y1, 1.0);
  const Vec3 y = R * x0;
  const Vec3 a = E * x0;
  const Vec3 b = E.transpose() * x1;
  const double scale =
      1.0 / std::sqrt(a.head<2>().squaredNorm() + b.head<2>().squaredNorm() + 1e-18);
  J->head<3>() = scale * y.cross(x1.cross(T.translation()));
  J->tail<2>() = scale * (tangents.transpose() * y.cross(x1));
  return scale * x1.dot(a);
}

void apply_step(const Vec5& step, const Mat32& tangents, SE3* T) {
  T->rotation() = SO3::exp(step.head<3>()) * T->rotation();
  T->translation() = (T->translation() + tangents * step.tail<2>()).normalized();
}

/// Five unknowns from five correspondences.
bool solve_minimal(const std::array<const Correspondence*, 5>& sample, int iterations, SE3* T) {
  for (int i = 0; i < iterations; ++i) {
    const Mat3 R = T->rotation_matrix();
    const Mat3 E = essential(*T);
    const Mat32 tangents = tangent_basis(T->translation());
    Mat5 J;
    Vec5 r;
    for (int k = 0; k < 5; ++k) {
      Vec5 row;
      r[k] = linearize(*sample[static_cast<std::size_t>(k)], *T, R, E, tangents, &row);
      J.row(k) = row.transpose();
    }
    Mat5 H = J.transpose() * J;
    H.diagonal() *= 1.0 + 1e-6;
    H.diagonal() += Vec5::Constant(1e-12);
    Vec5 step = -solve_small(H, J.transpose() * r);
    if (!step.allFinite()) return false;
    const double length = step.norm();
    if (length > 0.7) step *= 0.7 / length;
    apply_step(step, tangents, T);
    if (length < 1e-7) break;
  }
  return true;
}

double truncated_cost(const std::vector<Correspondence>& matches, const SE3& T, double limit,
                      double give_up) {
  const Mat3 E = essential(T);
  const double limit2 = limit * limit;
  double cost = 0.0;
  for (const Correspondence& m : matches) {
    const double d = sampson(m, E);
    cost += std::min(d * d, limit2);
    if (cost > give_up) break;
  }
  return cost;
}

/// Gauss-Newton over the correspondences within `limit` (chosen anew each step); returns the
/// Hessian of the last one.
Mat5 refine(const std::vector<Correspondence>& matches, double limit, int iterations, SE3* T) {
  Mat5 H = Mat5::Zero();
  SE3 best = *T;
  double best_cost = truncated_cost(matches, *T, limit, 1e300);
  for (int i = 0; i < iterations; ++i) {
    const Mat3 R = T->rotation_matrix();
    const Mat3 E = essential(*T);
    const Mat32 tangents = tangent_basis(T->translation());
    Mat5 sum = Mat5::Zero();
    Vec5 g = Vec5::Zero();
    for (const Correspondence& m : matches) {
      Vec5 J;
      const double r = linearize(m, *T, R, E, tangents, &J);
      const double q = r / limit;
      if (std::abs(q) >= 1.0) continue;
      const double w = (1.0 - q * q) * (1.0 - q * q);  // Tukey
      sum.selfadjointView<Eigen::Lower>().rankUpdate(J, w);
      g += w * r * J;
    }
    H = sum.selfadjointView<Eigen::Lower>();
    Mat5 damped = H;
    damped.diagonal() *= 1.0 + 1e-6;
    damped.diagonal() += Vec5::Constant(1e-12);
    const Vec5 step = -solve_small(damped, g);
    if (!step.allFinite() || step.norm() > 1.0) break;
    apply_step(step, tangents, T);
    const double cost = truncated_cost(matches, *T, limit, 1e300);
    if (cost < best_cost) {
      best_cost = cost;
      best = *T;
    }
    if (step.norm() < 1e-8) break;
  }
  *T = best;
  return H;
}

Vec3 random_direction(std::mt19937* random) {
  Vec3 v;
  do {
    for (int i = 0; i < 3; ++i) v[i] = static_cast<double>((*random)()) / 2147483648.0 - 1.0;
  } while (v.squaredNorm() > 1.0 || v.squaredNorm() < 1e-3);
  return v.normalized();
}

/// Flips the translation when most inliers lie behind the first view.
void resolve_sign(const std::vector<Correspondence>& matches, const std::vector<std::uint8_t>& use,
                  double focal, SE3* T) {
  double in_front = 0.0;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (use[i] == 0) continue;
    double sigma = 0.0;
    const double rho = triangulate_inverse_depth(matches[i], *T, focal, &sigma);
    if (sigma <= 0.0) continue;
    in_front += std::clamp(rho / sigma, -5.0, 5.0);
  }
  if (in_front < 0.0) T->translation() = -T->translation();
}

}  // namespace

EpipolarPose estimate_epipolar_pose(const std::vector<Correspondence>& matches, double focal,
                                    const SE3& start, std::uint32_t seed,
                                    const EpipolarPoseConfig& config) {
  EpipolarPose result;
  if (matches.size() < 12) return result;
  std::mt19937 random(seed);
  const double limit = config.inlier_px / focal;
  const bool has_start = start.translation().norm() > 0.5;
  SE3 best = start;
  double best_cost = 1e300;
  if (has_start) best_cost = truncated_cost(matches, start, limit, best_cost);
  for (int h = 0; h < config.hypotheses; ++h) {
    std::array<const Correspondence*, 5> sample{};
    for (auto& s : sample) s = &matches[random() % matches.size()];
    SE3 T = start;
    if (!has_start || h % 4 != 0) T.translation() = random_direction(&random);
    if (!solve_minimal(sample, config.minimal_iterations, &T)) continue;
    double cost = truncated_cost(matches, T, limit, best_cost);
    if (cost >= best_cost) continue;
    refine(matches, 2.0 * limit, 3, &T);
    cost = std::min(cost, truncated_cost(matches, T, limit, 1e300));
    if (cost >= best_cost) continue;
    best_cost = cost;
    best = T;
  }
  if (best_cost >= 1e300) return result;
  const Mat5 H = refine(matches, limit, config.refinement_iterations, &best);
  result.T_1_0 = best;
  result.is_inlier.assign(matches.size(), 0);
  const Mat3 E = essential(best);
  double sum = 0.0;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const double d = sampson(matches[i], E) * focal;
    result.cost += std::min(d * d, config.inlier_px * config.inlier_px);
    if (std::abs(d) > config.inlier_px) continue;
    result.is_inlier[i] = 1;
    ++result.inliers;
    sum += d * d;
  }
  result.cost /= static_cast<double>(matches.size());
  if (result.inliers < 12) return result;
  resolve_sign(matches, result.is_inlier, focal, &result.T_1_0);
  result.rms_px = std::sqrt(sum / result.inliers);
  const double sigma = std::max(result.rms_px, 0.1) / focal;
  const Mat5 covariance = (H + 1e-9 * Mat5::Identity()).inverse() * sigma * sigma;
  result.direction_sigma = std::sqrt(covariance.diagonal().tail<2>().sum());
  result.valid = std::isfinite(result.direction_sigma);
  return result;
}

SO3 estimate_rotation(const std::vector<Correspondence>& matches, double focal, const SO3& start,
                      double inlier_px, double* cost, double* median_px) {
  SO3 R = start;
  std::vector<double> distances(matches.size());
  *cost = 0.0;
  *median_px = 0.0;
  if (matches.size() < 3) return R;
  for (int iteration = 0; iteration < 10; ++iteration) {
    Mat3 H = 1e-9 * Mat3::Identity();
    Vec3 g = Vec3::Zero();
    *cost = 0.0;
    for (std::size_t i = 0; i < matches.size(); ++i) {
      const Correspondence& m = matches[i];
      const Vec3 p = R * Vec3(m.x0, m.y0, 1.0);
      const double x = p.x() / p.z(), y = p.y() / p.z();
      const Vec2 r(x - m.x1, y - m.y1);
      const double distance = r.norm() * focal;
      distances[i] = distance;
      *cost += std::min(distance * distance, inlier_px * inlier_px);
      Mat23 J;
      J << -x * y, 1.0 + x * x, -y, -(1.0 + y * y), x * y, x;
      const double w = 1.0 / std::max(distance, 0.3);  // L1
      H += w * J.transpose() * J;
      g += w * J.transpose() * r;
    }
    if (iteration == 9) break;
    R = SO3::exp(-solve_small(H, g)) * R;
  }
  *cost /= static_cast<double>(matches.size());
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  *median_px = *middle;
  return R;
}

double triangulate_inverse_depth(const Correspondence& match, const SE3& T_1_0, double focal,
                                 double* sigma_per_px) {
  // (y + rho t) projected is (x1, y1): rho (t.xy - x1 t.z) = x1 y.z - y.xy, least squares.
  const Vec3 y = T_1_0.rotation() * Vec3(match.x0, match.y0, 1.0);
  const Vec3& t = T_1_0.translation();
  const Vec2 x1(match.x1, match.y1);
  const Vec2 d = t.head<2>() - x1 * t.z();
  const Vec2 e = x1 * y.z() - y.head<2>();
  const double d2 = d.squaredNorm();
  *sigma_per_px = 0.0;
  if (d2 < 1e-12) return 0.0;
  const double rho = d.dot(e) / d2;
  *sigma_per_px = std::abs(y.z() + rho * t.z()) / (focal * std::sqrt(d2));
  return rho;
}

}  // namespace sovo
