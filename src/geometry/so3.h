#pragma once

#include <Eigen/Geometry>
#include <cmath>

#include "sovo/geometry/types.h"

namespace sovo {

/// Skew-symmetric matrix of w: hat(w) * v = w x v.
inline Mat3 hat(const Vec3& w) {
  Mat3 m;
  m << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  return m;
}

namespace so3_detail {

/// The three scalar series of rotation: sin(t)/t, (1-cos t)/t^2, (t-sin t)/t^3.
struct Series {
  double a, b, c;
};

inline Series series(double theta_squared) {
  if (theta_squared < 1e-4) {  // the closed forms lose digits from here on
    const double t2 = theta_squared;
    return {1.0 - t2 / 6.0 * (1.0 - t2 / 20.0), 0.5 - t2 / 24.0 * (1.0 - t2 / 30.0),
            1.0 / 6.0 - t2 / 120.0 * (1.0 - t2 / 42.0)};
  }
  const double theta = std::sqrt(theta_squared);
  return {std::sin(theta) / theta, (1.0 - std::cos(theta)) / theta_squared,
          (theta - std::sin(theta)) / (theta_squared * theta)};
}

}  // namespace so3_detail

/// Rotation in three dimensions, kept as a unit quaternion. `R_a_b * v_b = v_a`.
class SO3 {
 public:
  SO3() : q_(Eigen::Quaterniond::Identity()) {}
  /// From a quaternion of any non-zero length.
  explicit SO3(const Eigen::Quaterniond& q) : q_(q.normalized()) {}
  /// From a rotation matrix; small departures from orthonormality are projected away.
  explicit SO3(const Mat3& r) : q_(Eigen::Quaterniond(r).normalized()) {}

  /// Rotation about w by |w| radians (Rodrigues).
  static SO3 exp(const Vec3& w) {
    const double half_squared = 0.25 * w.squaredNorm();
    const auto s = so3_detail::series(half_squared);
    const double cos_half = std::cos(std::sqrt(half_squared));
    const Vec3 v = 0.5 * s.a * w;
    return SO3(Eigen::Quaterniond(cos_half, v.x(), v.y(), v.z()));
  }

  /// Rotation vector [rad] of length at most pi.
  Vec3 log() const {
    const double sign = q_.w() < 0.0 ? -1.0 : 1.0;
    const Vec3 v = sign * q_.vec();
    const double n = v.norm();
    if (n < 1e-10) return 2.0 * v;
    return 2.0 * std::atan2(n, sign * q_.w()) / n * v;
  }

  SO3 inverse() const { return SO3(q_.conjugate()); }
  SO3 operator*(const SO3& other) const { return SO3(q_ * other.q_); }
  Vec3 operator*(const Vec3& v) const { return q_ * v; }
  Mat3 matrix() const { return q_.toRotationMatrix(); }
  const Eigen::Quaterniond& quaternion() const { return q_; }

  /// Adjoint: R * exp(w) * R^-1 = exp(adjoint * w).
  Mat3 adjoint() const { return matrix(); }

  /// d exp(w + e) = exp(left_jacobian(w) * e) * exp(w) for small e.
  static Mat3 left_jacobian(const Vec3& w) {
    const auto s = so3_detail::series(w.squaredNorm());
    const Mat3 k = hat(w);
    return Mat3::Identity() + s.b * k + s.c * k * k;
  }

  static Mat3 left_jacobian_inverse(const Vec3& w) {
    const double t2 = w.squaredNorm();
    const Mat3 k = hat(w);
    double coefficient = 1.0 / 12.0 + t2 / 720.0;
    if (t2 >= 1e-6) {
      const auto s = so3_detail::series(t2);
      coefficient = (1.0 - s.a / (2.0 * s.b)) / t2;
    }
    return Mat3::Identity() - 0.5 * k + coefficient * k * k;
  }

 private:
  Eigen::Quaterniond q_;
};

}  // namespace sovo
