#include "sovo/odometry/recognized_tracking.h"

#include <utility>

namespace sovo {

bool is_better(const TrackedFrame& found, const TrackedFrame& before,
               const ReckonedPose& expected) {
  constexpr double kClearly = 0.9;
  if (!found.tracking.good || !before.tracking.good) return found.tracking.good;
  const bool likelier =
      expected.is_likely(found.T_world_camera) && !expected.is_likely(before.T_world_camera);
  return likelier || found.tracking.rmse < kClearly * before.tracking.rmse;
}

bool is_doubtful(const TrackedFrame& tracked, const DeadReckoning& reckoning) {
  constexpr double kWhile = 0.25;  // [s]
  constexpr double kFitsWell = 0.75;
  return tracked.tracking.inlier_ratio < kFitsWell &&
         reckoning.seconds_since_last(tracked.frame.stamp_ns) > kWhile;
}

bool track_where(const SE3& T_odom_left, const DeadReckoning& reckoning, MapSegment* segment,
                 TrackedFrame* tracked) {
  const SE3 T_current_reference = T_odom_left.inverse() * segment->vo().reference()->T_world_camera;
  TrackedFrame found = segment->track_from(tracked->frame, T_current_reference);
  if (!is_better(found, *tracked, reckoning.reckon(tracked->frame.stamp_ns))) {
    segment->take_back(*tracked);
    return false;
  }
  *tracked = std::move(found);
  return true;
}

}  // namespace sovo
