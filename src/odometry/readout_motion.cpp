#include "sovo/odometry/readout_motion.h"

namespace sovo {

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

bool ReadoutMotion::differs(const Vec6& found, const TrackedFrame& tracked) const {
  constexpr double kVisible = 0.1;  // [px]
  return preparation_.displacement(found - tracked.frame.rate, tracked.reference->mean_rho) >
         kVisible;
}

bool ReadoutMotion::is_steady(const Vec6& expected) const {
  constexpr double kMostDisplaced = 1.0;  // [px]
  Vec6 turn = found() - expected;
  turn.head<3>().setZero();
  return preparation_.displacement(turn, 0.0) < kMostDisplaced;
}

}  // namespace sovo
