#include "sovo/odometry/readout_motion.h"

#include <cmath>

namespace sovo {

namespace {

/// (no way, turn)
Vec6 turning(const Vec3& turn) {
  Vec6 rate = Vec6::Zero();
  rate.tail<3>() = turn;
  return rate;
}

}  // namespace

void ReadoutMotion::begin(const ReferenceKeyframe& reference) {
  if (!preparation_.has_rolling_shutter()) return;
  last_stamp_ns_ = reference.stamp_ns;
  motion_.note(reference, SE3(), last_stamp_ns_);
}

void ReadoutMotion::note(const TrackedFrame& tracked) {
  if (!preparation_.has_rolling_shutter() || !tracked.tracking.good) return;
  last_stamp_ns_ = tracked.frame.stamp_ns;
  motion_.note(*tracked.reference, tracked.tracking.T_current_reference, last_stamp_ns_);
}

Vec6 ReadoutMotion::expected(std::int64_t stamp_ns) const {
  return motion_.rate_after(seconds_between(last_stamp_ns_, stamp_ns));
}

std::optional<Vec6> ReadoutMotion::contradicted(const TrackedFrame& tracked) const {
  constexpr double kSigmas = 3.0;
  constexpr double kStructure = 1.0 / kSigmas;  // [px]
  if (!tracked.tracking.readout_turn) return std::nullopt;
  const ReadoutTurn& seen = *tracked.tracking.readout_turn;
  const double structure = kStructure / preparation_.displacement(turning(Vec3::UnitX()), 0.0);
  const Mat3 covariance = seen.information.inverse() + structure * structure * Mat3::Identity();
  const Vec3 difference = seen.rate - tracked.frame.rate.tail<3>();
  const double squared = difference.dot(covariance.inverse() * difference);
  if (squared < kSigmas * kSigmas) return std::nullopt;
  Vec6 rate = motion_.rate_before();
  rate.tail<3>() = seen.rate;
  return rate;
}

bool ReadoutMotion::differs(const Vec6& found, const TrackedFrame& tracked) const {
  constexpr double kVisible = 0.1;  // [px]
  return preparation_.displacement(found - tracked.frame.rate, tracked.reference->mean_rho) >
         kVisible;
}

bool ReadoutMotion::is_steady(const TrackedFrame& tracked) const {
  constexpr double kMostDisplaced = 1.0;  // [px]
  constexpr double kFits = 0.85;
  if (!tracked.tracking.readout_turn || tracked.tracking.inlier_ratio > kFits) return true;
  const Vec3 left = tracked.tracking.readout_turn->rate - tracked.frame.rate.tail<3>();
  return preparation_.displacement(turning(left), 0.0) < kMostDisplaced;
}

}  // namespace sovo
