#include "sovo/eval/absolute_error.h"

#include <Eigen/SVD>

namespace sovo {
namespace {

std::vector<Vec3> positions_of(std::span<const SE3> poses) {
  std::vector<Vec3> positions;
  positions.reserve(poses.size());
  for (const SE3& pose : poses) positions.push_back(pose.translation());
  return positions;
}

/// The rotation nearest to m in the Frobenius norm.
Mat3 nearest_rotation(const Mat3& m) {
  const Eigen::JacobiSVD<Mat3> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = svd.matrixU().determinant() * svd.matrixV().determinant();
  return svd.matrixU() * Vec3(1.0, 1.0, sign < 0.0 ? -1.0 : 1.0).asDiagonal() *
         svd.matrixV().transpose();
}

}  // namespace

AbsoluteError absolute_error(std::span<const SE3> truth, std::span<const SE3> estimate,
                             AlignmentKind kind) {
  const std::vector<Vec3> to = positions_of(truth);
  const std::vector<Vec3> from = positions_of(estimate);
  AbsoluteError out;
  out.kind = kind;
  out.S_truth_estimate = align(from, to, kind);
  out.errors.reserve(to.size());
  for (std::size_t i = 0; i < to.size(); ++i) {
    out.errors.push_back((to[i] - out.S_truth_estimate * from[i]).norm());
  }
  out.translation = statistics_of(out.errors);
  return out;
}

std::vector<double> rotation_errors(std::span<const SE3> truth, std::span<const SE3> estimate) {
  Mat3 sum = Mat3::Zero();
  for (std::size_t i = 0; i < truth.size(); ++i) {
    sum += truth[i].rotation_matrix() * estimate[i].rotation_matrix().transpose();
  }
  const SO3 R_truth_estimate(nearest_rotation(sum));
  std::vector<double> errors;
  errors.reserve(truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const SO3 aligned = R_truth_estimate * estimate[i].rotation();
    errors.push_back((truth[i].rotation().inverse() * aligned).log().norm());
  }
  return errors;
}

}  // namespace sovo
