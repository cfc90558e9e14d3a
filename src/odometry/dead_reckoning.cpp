#include "sovo/odometry/dead_reckoning.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sovo/vo/motion_model.h"

namespace sovo {

namespace {

/// A frame or two before a loss may be wrong already: of so many steps the median counts.
constexpr std::size_t kSteps = 5;
constexpr double kWayGoesOn = 2.0;   ///< [s]
constexpr double kTurnGoesOn = 0.5;  ///< [s]

// How far a camera departs from that: by a share of its way, by accelerations [m/s^2] and by other
// turns [rad/s]; vehicles usually, and at most.
constexpr double kUsualShare = 0.1;
constexpr double kUsualAcceleration = 2.0;
constexpr double kUsualTurn = 0.3;
constexpr double kMostShare = 0.25;
constexpr double kMostAcceleration = 20.0;
constexpr double kMostTurn = 5.0;
constexpr double kBlow = 0.2;  ///< [rad]

}  // namespace

void DeadReckoning::note(std::int64_t stamp_ns, const SE3& T_odom_left, bool goes_on) {
  if (goes_on && last_stamp_ns_ && stamp_ns > *last_stamp_ns_) {
    const SE3 step = last_.inverse() * T_odom_left;
    rates_.push_back(step.log() / seconds_between(*last_stamp_ns_, stamp_ns));
    if (rates_.size() > kSteps) rates_.erase(rates_.begin());
  }
  last_ = T_odom_left;
  last_stamp_ns_ = stamp_ns;
}

Vec6 DeadReckoning::usual_rate() const {
  Vec6 out = Vec6::Zero();
  if (rates_.empty()) return out;
  std::vector<double> values(rates_.size());
  for (Eigen::Index axis = 0; axis < 6; ++axis) {
    std::ranges::transform(rates_, values.begin(), [axis](const Vec6& r) { return r[axis]; });
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) / 2);
    std::ranges::nth_element(values, middle);
    out[axis] = *middle;
  }
  return out;
}

double DeadReckoning::seconds_since_last(std::int64_t stamp_ns) const {
  return last_stamp_ns_ ? seconds_between(*last_stamp_ns_, stamp_ns) : 0.0;
}

SE3 DeadReckoning::since_last(std::int64_t stamp_ns) const {
  if (!last_stamp_ns_) return {};
  const double since = std::clamp(seconds_between(*last_stamp_ns_, stamp_ns), 0.0, kWayGoesOn);
  const double turning = std::min(since, kTurnGoesOn);
  const Vec6 rate = usual_rate();
  const SE3 straight_on(SO3(), (since - turning) * rate.head<3>());
  return SE3::exp(turning * rate) * straight_on;
}

ReckonedPose DeadReckoning::reckon(std::int64_t stamp_ns) const {
  ReckonedPose out;
  const SE3 moved = since_last(stamp_ns);
  out.T_odom_left = last_ * moved;
  if (rates_.empty()) {
    out.possible_m = out.possible_rad = std::numeric_limits<double>::infinity();
    return out;
  }
  out.knows_motion = true;
  const double since = seconds_between(*last_stamp_ns_, stamp_ns);
  const double way = moved.translation().norm();
  out.likely_m = kUsualShare * way + 0.5 * kUsualAcceleration * since * since;
  out.likely_rad = kUsualTurn * since;
  out.possible_m = kMostShare * way + 0.5 * kMostAcceleration * since * since;
  out.possible_rad = kBlow + kMostTurn * since;
  return out;
}

bool ReckonedPose::is_within(const SE3& T_odom_other, double metres, double radians) const {
  const SE3 off = T_odom_left.inverse() * T_odom_other;
  return off.translation().norm() <= metres && off.rotation().log().norm() <= radians;
}

}  // namespace sovo
