#include "sovo/odometry/right_camera.h"

#include <cmath>

namespace sovo {

namespace {

/// Part by which it is not known what a change of the turn makes of the scale.
constexpr double kTurnError = 0.3;
/// Changes of the turn to which a scale can be brought that was accepted, and any.
constexpr double kMostPx = 1.5;
constexpr double kMostUncertainPx = 0.3;

/// From one rotation to another; exactly zero where they are the same [rad].
Vec3 difference(const SO3& from, const SO3& to) {
  const bool same = from.quaternion().coeffs() == to.quaternion().coeffs();
  return same ? Vec3::Zero() : (to * from.inverse()).log();
}

}  // namespace

RightCamera::RightCamera(const StaticMatcherConfig& config, const StereoRig& rig,
                         const RightTurn& known)
    : config_(config), calibrated_(rig), turn_(known), matcher_(config, this->rig()) {}

RightTurn RightCamera::known() const {
  const std::lock_guard lock(mutex_);
  return turn_;
}

double RightCamera::note(const SO3& given, ScaleEstimate* estimate) {
  const SO3 before = turn();
  {
    const std::lock_guard lock(mutex_);
    turn_.note(estimate->turn, given);
  }
  const Vec3& slope = estimate->turn.scale_by_turn;
  const Vec3 since_given = difference(given, turn());
  estimate->log_scale += slope.dot(since_given);
  estimate->sigma = std::hypot(estimate->sigma, kTurnError * slope.dot(since_given));
  const bool accepted = estimate->verdict == ScaleVerdict::kAccepted;
  const double px = calibrated_.right.fx * since_given.norm();
  if (turn_.in_doubt() || px > (accepted ? kMostPx : kMostUncertainPx)) {
    estimate->verdict = ScaleVerdict::kUnobservable;
  }
  const Vec3 changed = difference(before, turn());
  if (!changed.isZero(0.0)) matcher_ = StaticMatcher(config_, rig());
  return slope.dot(changed);
}

}  // namespace sovo
