#include "sovo/vo/features/feature_pose.h"

#include <cmath>
#include <limits>

#include "sovo/geometry/linear_solvers.h"
#include "sovo/vo/features/reprojection.h"
#include "sovo/vo/features/residual_spread.h"

namespace sovo {

namespace {

/// Error of a match at a pose, and the information on it.
struct MatchError {
  Reprojection at;
  Vec2 residual;
  Mat2 information;
  double squared = std::numeric_limits<double>::infinity();  ///< In its covariance.
};

bool error_of(const CameraModel& camera, const FeatureMatch& m, const SE3& T, MatchError* out) {
  if (!reproject(camera, T * m.T_reference_host, m.ray, m.rho, &out->at)) return false;
  out->residual = m.pixel - out->at.pixel;
  const Vec2 by_depth = m.rho_sigma * out->at.d_rho;
  const Mat2 covariance = m.sigma * m.sigma * Mat2::Identity() + by_depth * by_depth.transpose();
  const double determinant =
      covariance(0, 0) * covariance(1, 1) - covariance(0, 1) * covariance(1, 0);
  out->information << covariance(1, 1), -covariance(0, 1), -covariance(1, 0), covariance(0, 0);
  out->information /= determinant;
  out->squared = out->residual.dot(out->information * out->residual);
  return true;
}

/// Errors of all matches; infinite behind the camera.
std::vector<double> errors_at(const CameraModel& camera, const std::vector<FeatureMatch>& matches,
                              const SE3& T) {
  std::vector<double> out;
  for (const FeatureMatch& m : matches) {
    MatchError e;
    error_of(camera, m, T, &e);
    out.push_back(std::sqrt(e.squared));
  }
  return out;
}

/// Of an error, by its square, under Cauchy's loss with this scale.
double cauchy_weight(double squared, double scale) {
  return 1.0 / (1.0 + squared / (scale * scale));
}

struct Normal {
  Mat6 H = Mat6::Zero();
  Vec6 b = Vec6::Zero();
};

/// Cauchy's loss of errors in units of `scale`.
Normal normal_equations(const CameraModel& camera, const std::vector<FeatureMatch>& matches,
                        const SE3& T, double scale) {
  Normal out;
  for (const FeatureMatch& m : matches) {
    MatchError e;
    if (!error_of(camera, m, T, &e)) continue;
    const double w = cauchy_weight(e.squared, scale);
    out.H += w * e.at.d_target.transpose() * e.information * e.at.d_target;
    out.b += w * e.at.d_target.transpose() * e.information * e.residual;
  }
  return out;
}

}  // namespace

FeaturePose estimate_pose(const CameraModel& camera, const std::vector<FeatureMatch>& matches,
                          const SE3& start, double outlier_sigmas) {
  constexpr int kIterations = 15;
  constexpr double kCauchy = 2.0;
  constexpr double kConverged = 1e-7;
  FeaturePose out;
  out.T_current_reference = start;
  out.inlier.assign(matches.size(), false);
  if (matches.size() < 6) return out;
  for (int i = 0; i < kIterations; ++i) {
    // From far off all errors are large, and none of them is an outlier yet.
    const double spread = residual_spread(errors_at(camera, matches, out.T_current_reference));
    if (!std::isfinite(spread)) return out;
    const Normal n =
        normal_equations(camera, matches, out.T_current_reference, kCauchy * std::max(1.0, spread));
    Mat6 H = n.H;
    H.diagonal() *= 1.0 + 1e-6;
    const Vec6 step = solve_small(H, n.b);
    if (!step.allFinite()) return out;
    out.T_current_reference = SE3::exp(step) * out.T_current_reference;
    if (step.squaredNorm() < kConverged * kConverged) break;
  }
  const std::vector<double> errors = errors_at(camera, matches, out.T_current_reference);
  const double spread = residual_spread(errors);
  const double expected = spread_for_outliers(spread);
  double sum = 0.0;
  Mat6 information = Mat6::Zero();
  for (std::size_t i = 0; i < matches.size(); ++i) {
    out.inlier[i] = errors[i] < outlier_sigmas * expected;
    if (!out.inlier[i]) continue;
    MatchError e;
    error_of(camera, matches[i], out.T_current_reference, &e);
    ++out.inliers;
    sum += e.residual.squaredNorm();
    // The loss leaves so much of it.
    const double w = cauchy_weight(e.squared, kCauchy * expected);
    information += w * e.at.d_target.transpose() * e.information * e.at.d_target;
  }
  if (out.inliers == 0) return out;
  out.rmse = std::sqrt(sum / out.inliers);
  information = (information + 1e-6 * Mat6::Identity()).eval();
  out.covariance = std::pow(spread_for_covariance(spread), 2) * information.inverse();
  return out;
}

}  // namespace sovo
