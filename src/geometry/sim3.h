#pragma once

#include "sovo/geometry/se3.h"

namespace sovo {

/// Similarity: p_a = s * R * p_b + t. Tangent vectors are (translation, rotation, log-scale),
/// perturbations act on the left.
class Sim3 {
 public:
  Sim3() = default;
  Sim3(double scale, const SO3& r, const Vec3& t) : s_(scale), r_(r), t_(t) {}
  explicit Sim3(const SE3& T, double scale = 1.0)
      : s_(scale), r_(T.rotation()), t_(T.translation()) {}

  static Sim3 exp(const Vec7& x);
  Vec7 log() const;

  Sim3 inverse() const {
    const SO3 r = r_.inverse();
    return {1.0 / s_, r, -(r * t_) / s_};
  }
  Sim3 operator*(const Sim3& o) const { return {s_ * o.s_, r_ * o.r_, s_ * (r_ * o.t_) + t_}; }
  Vec3 operator*(const Vec3& p) const { return s_ * (r_ * p) + t_; }

  /// Adjoint (7x7): S * exp(x) * S^-1 = exp(adjoint * x).
  Mat7 adjoint() const;

  double scale() const { return s_; }
  const SO3& rotation() const { return r_; }
  const Vec3& translation() const { return t_; }

 private:
  double s_ = 1.0;
  SO3 r_;
  Vec3 t_ = Vec3::Zero();
};

}  // namespace sovo
