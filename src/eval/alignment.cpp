#include "sovo/eval/alignment.h"

#include <Eigen/SVD>
#include <cmath>

namespace sovo {
namespace {

Vec3 mean_of(std::span<const Vec3> points) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

/// Covariance sum (to - mean)(from - mean)^T / n (Umeyama eq. 38) and the variance of `from`.
struct Moments {
  Vec3 mean_from, mean_to;
  Mat3 covariance = Mat3::Zero();
  double variance_from = 0.0;
};

Moments moments_of(std::span<const Vec3> from, std::span<const Vec3> to) {
  Moments m{mean_of(from), mean_of(to)};
  const double n = static_cast<double>(from.size());
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Vec3 x = from[i] - m.mean_from;
    m.covariance += (to[i] - m.mean_to) * x.transpose() / n;
    m.variance_from += x.squaredNorm() / n;
  }
  return m;
}

/// Umeyama eq. 40-43: rotation and scale.
std::pair<Mat3, double> rotation_and_scale(const Moments& m) {
  const Eigen::JacobiSVD<Mat3> svd(m.covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vec3 sign = Vec3::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0) sign.z() = -1.0;
  const Mat3 r = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  const double trace = svd.singularValues().dot(sign);
  const bool still = !(m.variance_from > 0.0) || !(trace > 0.0);
  return {r, still ? 1.0 : trace / m.variance_from};
}

}  // namespace

Sim3 align(std::span<const Vec3> from, std::span<const Vec3> to, AlignmentKind kind) {
  if (from.empty()) return {};
  const Moments m = moments_of(from, to);
  Mat3 r;
  double scale = 1.0;
  if (kind == AlignmentKind::kYaw) {
    const double yaw = std::atan2(m.covariance(1, 0) - m.covariance(0, 1),
                                  m.covariance(0, 0) + m.covariance(1, 1));
    r = SO3::exp(Vec3(0.0, 0.0, yaw)).matrix();
  } else {
    std::tie(r, scale) = rotation_and_scale(m);
    if (kind == AlignmentKind::kRigid) scale = 1.0;
  }
  return {scale, SO3(r), m.mean_to - scale * (r * m.mean_from)};
}

}  // namespace sovo
