#pragma once

#include <Eigen/Core>
#include <cmath>

namespace sovo::test {

/// Derivative of f: R^N -> R^M at x by central differences, M rows and N columns.
template <int M, int N, class F>
Eigen::Matrix<double, M, N> central_differences(const F& f, const Eigen::Matrix<double, N, 1>& x,
                                                double step = 1e-6) {
  Eigen::Matrix<double, M, N> jacobian;
  for (int i = 0; i < N; ++i) {
    Eigen::Matrix<double, N, 1> above = x;
    Eigen::Matrix<double, N, 1> below = x;
    above[i] += step;
    below[i] -= step;
    jacobian.col(i) = (f(above) - f(below)) / (2.0 * step);
  }
  return jacobian;
}

/// |a - b| / max(|b|, 1e-12) in the Frobenius norm.
template <class A, class B>
double relative_difference(const A& a, const B& b) {
  return (a - b).norm() / std::max(b.norm(), 1e-12);
}

}  // namespace sovo::test
