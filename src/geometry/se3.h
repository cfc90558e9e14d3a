#pragma once

#include "sovo/geometry/so3.h"

namespace sovo {

/// Rigid motion. `T_a_b * p_b = p_a`. Tangent vectors are (translation, rotation), perturbations
/// act on the left: T <- exp(x) * T.
class SE3 {
 public:
  SE3() : t_(Vec3::Zero()) {}
  SE3(const SO3& r, const Vec3& t) : r_(r), t_(t) {}
  SE3(const Mat3& r, const Vec3& t) : r_(r), t_(t) {}
  explicit SE3(const Mat4& m) : r_(Mat3(m.topLeftCorner<3, 3>())), t_(m.topRightCorner<3, 1>()) {}

  static SE3 exp(const Vec6& x) {
    const Vec3 w = x.tail<3>();
    return {SO3::exp(w), SO3::left_jacobian(w) * x.head<3>()};
  }

  Vec6 log() const {
    Vec6 x;
    const Vec3 w = r_.log();
    x.head<3>() = SO3::left_jacobian_inverse(w) * t_;
    x.tail<3>() = w;
    return x;
  }

  SE3 inverse() const {
    const SO3 r = r_.inverse();
    return {r, -(r * t_)};
  }
  SE3 operator*(const SE3& other) const { return {r_ * other.r_, r_ * other.t_ + t_}; }
  Vec3 operator*(const Vec3& p) const { return r_ * p + t_; }

  /// Adjoint (6x6): T * exp(x) * T^-1 = exp(adjoint * x).
  Mat6 adjoint() const {
    Mat6 m = Mat6::Zero();
    const Mat3 r = r_.matrix();
    m.topLeftCorner<3, 3>() = r;
    m.bottomRightCorner<3, 3>() = r;
    m.topRightCorner<3, 3>() = hat(t_) * r;
    return m;
  }

  /// exp(x + e) = exp(left_jacobian(x) * e) * exp(x) for small e (Barfoot, "State Estimation for
  /// Robotics", eq. 7.85).
  static Mat6 left_jacobian(const Vec6& x);

  Mat4 matrix() const {
    Mat4 m = Mat4::Identity();
    m.topLeftCorner<3, 3>() = r_.matrix();
    m.topRightCorner<3, 1>() = t_;
    return m;
  }
  Mat3 rotation_matrix() const { return r_.matrix(); }
  const SO3& rotation() const { return r_; }
  const Vec3& translation() const { return t_; }
  SO3& rotation() { return r_; }
  Vec3& translation() { return t_; }

 private:
  SO3 r_;
  Vec3 t_;
};

}  // namespace sovo
