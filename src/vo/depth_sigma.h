#pragma once

#include <algorithm>
#include <cmath>

#include "sovo/vo/monocular_backend.h"
#include "sovo/vo/window.h"

namespace sovo {

/// Noise of one pixel of a residual, from which depth information follows [grey levels].
inline constexpr double kPixelNoise = 5.0;

/// Standard deviation of a point's inverse depth [1/m]; 0 when that says nothing about its depth.
/// `rho_unit`: the window's mean inverse depth [1/m].
inline double known_sigma(const Point& p, double rho_unit) {
  const double information = depth_information(p, rho_unit);
  if (information <= 0.0) return 0.0;
  // Pattern pixels are correlated: half of them count.
  const double sigma = kPixelNoise * std::sqrt(2.0 / information);
  return sigma > kMaxRelativeSigma * p.rho ? 0.0 : sigma;
}

/// The same as `Point::hessian` that a static match's deviation stands for.
inline double information_of_sigma(float sigma) {
  return std::pow(kPixelNoise / std::max(sigma, 1e-6F), 2);
}

}  // namespace sovo
