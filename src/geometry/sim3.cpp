#include "sovo/geometry/sim3.h"

#include <Eigen/LU>
#include <cmath>

namespace sovo {

namespace {

/// W with t = W * rho in exp((rho, w, sigma)): the integral over tau in [0, 1] of
/// e^(sigma tau) exp(tau hat(w)), written as a I + b hat(w) + c hat(w)^2
/// (Strasdat, "Local accuracy and global consistency for efficient visual SLAM", §2.4).
Mat3 translation_jacobian(const Vec3& w, double sigma) {
  const double t2 = w.squaredNorm();
  const double t = std::sqrt(t2);
  const double s = std::exp(sigma);
  const bool small_sigma = std::abs(sigma) < 1e-5;
  const double a = small_sigma ? 1.0 + 0.5 * sigma : (s - 1.0) / sigma;
  double b;
  double c;
  if (t < 1e-5) {
    b = small_sigma ? 0.5 + sigma / 3.0 : (1.0 + s * (sigma - 1.0)) / (sigma * sigma);
    c = small_sigma
            ? 1.0 / 6.0 + sigma / 8.0
            : (s * (sigma * sigma - 2.0 * sigma + 2.0) - 2.0) / (2.0 * sigma * sigma * sigma);
  } else {
    const double n = t2 + sigma * sigma;
    const double sin_integral = (t + s * (sigma * std::sin(t) - t * std::cos(t))) / n;
    const double cos_integral = (s * (sigma * std::cos(t) + t * std::sin(t)) - sigma) / n;
    b = sin_integral / t;
    c = (a - cos_integral) / t2;
  }
  const Mat3 k = hat(w);
  return a * Mat3::Identity() + b * k + c * k * k;
}

}  // namespace

Sim3 Sim3::exp(const Vec7& x) {
  const Vec3 w = x.segment<3>(3);
  return {std::exp(x[6]), SO3::exp(w), translation_jacobian(w, x[6]) * x.head<3>()};
}

Vec7 Sim3::log() const {
  Vec7 x;
  const Vec3 w = r_.log();
  x[6] = std::log(s_);
  x.segment<3>(3) = w;
  x.head<3>() = translation_jacobian(w, x[6]).partialPivLu().solve(t_);
  return x;
}

Mat7 Sim3::adjoint() const {
  Mat7 m = Mat7::Zero();
  const Mat3 r = r_.matrix();
  m.topLeftCorner<3, 3>() = s_ * r;
  m.block<3, 3>(0, 3) = hat(t_) * r;
  m.block<3, 1>(0, 6) = -t_;
  m.block<3, 3>(3, 3) = r;
  m(6, 6) = 1.0;
  return m;
}

}  // namespace sovo
