#pragma once

#include <Eigen/Cholesky>
#include <span>

#include "sovo/geometry/types.h"

namespace sovo {

/// Normalized estimation error squared, e^T C^-1 e: its mean over many errors is their dimension
/// when the covariances are honest. NaN when C is not positive definite.
template <int N>
double nees(const Eigen::Matrix<double, N, 1>& error,
            const Eigen::Matrix<double, N, N>& covariance) {
  const Eigen::LLT<Eigen::Matrix<double, N, N>> llt(covariance);
  if (llt.info() != Eigen::Success) return std::numeric_limits<double>::quiet_NaN();
  return error.dot(llt.solve(error));
}

/// Consistency of a set of one-dimensional errors with the standard deviations claimed for them.
struct NeesSummary {
  int count = 0;         ///< Errors with a positive, finite sigma; others are left out.
  double mean = 0.0;     ///< Mean of (error / sigma)^2: 1 when honest, above when optimistic.
  double lower95 = 0.0;  ///< 95 % bounds of `mean` for honest, independent errors (chi-square by
  double upper95 = 0.0;  ///< Wilson and Hilferty's approximation).
};

/// Precondition: as many sigmas as errors.
NeesSummary nees_summary(std::span<const double> errors, std::span<const double> sigmas);

}  // namespace sovo
