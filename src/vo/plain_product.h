#pragma once

#include <Eigen/Core>

namespace sovo {

/// m * v, rounded after every operation on every machine: Eigen's own product multiplies and adds
/// at once on ARM, and the pixels that kernels read would depend on it.
inline Eigen::Vector3f plain_product(const Eigen::Matrix3f& m, const Eigen::Vector3f& v) {
  const auto row = [&](Eigen::Index i) {
    return m(i, 0) * v[0] + (m(i, 1) * v[1] + m(i, 2) * v[2]);
  };
  return {row(0), row(1), row(2)};
}
inline Eigen::Matrix3f plain_product(const Eigen::Matrix3f& a, const Eigen::Matrix3f& b) {
  Eigen::Matrix3f out;
  for (Eigen::Index i = 0; i < 3; ++i) out.col(i) = plain_product(a, Eigen::Vector3f(b.col(i)));
  return out;
}

}  // namespace sovo
