#pragma once

#include "sovo/geometry/se3.h"

namespace sovo {

// Covariances of poses T_world_body, of (translation, rotation) about fixed world axes: the true
// position is p + dp, the true rotation exp(dtheta) R. Where steps err independently, their
// covariances are summed as seen from the origin, `carried` by -p, where none has to be carried on.

/// That of (translation, rotation) in a body's axes, seen in those of the world.
inline Mat6 rotated(const SO3& R_world_body, const Mat6& covariance) {
  Mat6 J = Mat6::Zero();
  J.topLeftCorner<3, 3>() = J.bottomRightCorner<3, 3>() = R_world_body.matrix();
  return J * covariance * J.transpose();
}

/// What a pose's covariance becomes at another one, `step` away from it (world axes), when it is
/// known without error how the one hangs on the other: dp' = dp + dtheta x step.
inline Mat6 carried(const Mat6& covariance, const Vec3& step) {
  Mat6 F = Mat6::Identity();
  F.topRightCorner<3, 3>() = -hat(step);
  return F * covariance * F.transpose();
}

}  // namespace sovo
