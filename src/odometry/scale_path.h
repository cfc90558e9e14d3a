#pragma once

#include "sovo/geometry/types.h"

namespace sovo {

/// What errors of the scale add to the covariance of positions since a segment began: one of every
/// step's length.
class ScalePath {
 public:
  /// The camera has come to `position`, with a scale of standard deviation `sigma`, made for steps
  /// that are summed as if their errors were independent.
  void extend(const Vec3& position, double sigma) {
    covariance_ = at(position, sigma);
    until_ = position;
  }

  /// Nothing is added up to `position`.
  void restart(const Vec3& position) {
    covariance_.setZero();
    until_ = position;
  }

  /// Covariance of `position`, reached with a scale of standard deviation `sigma` [m^2].
  Mat3 at(const Vec3& position, double sigma) const {
    const Vec3 step = position - until_;
    return covariance_ + sigma * sigma * step * step.transpose();
  }

 private:
  Mat3 covariance_ = Mat3::Zero();
  Vec3 until_ = Vec3::Zero();
};

}  // namespace sovo
