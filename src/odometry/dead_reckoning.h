#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "sovo/geometry/se3.h"

namespace sovo {

/// Where a camera should be, and how far from there it may be.
struct ReckonedPose {
  SE3 T_odom_left;
  bool knows_motion = false;                    ///< What the camera did before; else all is open.
  double likely_m = 0.0, likely_rad = 0.0;      ///< Most are nearer than this.
  double possible_m = 0.0, possible_rad = 0.0;  ///< None is farther than this.

  bool is_likely(const SE3& T_odom_other) const {
    return is_within(T_odom_other, likely_m, likely_rad);
  }
  bool is_possible(const SE3& T_odom_other) const {
    return is_within(T_odom_other, possible_m, possible_rad);
  }

 private:
  bool is_within(const SE3& T_odom_other, double metres, double radians) const;
};

/// Where the camera is while nothing tracks it: it goes on as it did last. A vehicle keeps its way
/// for some seconds, and its turn for a part of one.
class DeadReckoning {
 public:
  /// Notes a tracked frame's pose, of metric length. `goes_on`: the pose noted before is of the
  /// same segment, so that the camera moved from there to here.
  void note(std::int64_t stamp_ns, const SE3& T_odom_left, bool goes_on);

  /// Forgets how the camera moved.
  void forget_motion() { rates_.clear(); }

  /// T_odom_left at `stamp_ns`; the identity when nothing was noted.
  SE3 at(std::int64_t stamp_ns) const { return last_ * since_last(stamp_ns); }

  /// The same, with how far to believe it. Where no motion is known nothing is likely, and all is
  /// possible.
  ReckonedPose reckon(std::int64_t stamp_ns) const;

  /// Since a pose was noted last; 0 when none was.
  double seconds_since_last(std::int64_t stamp_ns) const;

  /// T_last_now: what it moves by `stamp_ns` from where it was noted last.
  SE3 since_last(std::int64_t stamp_ns) const;

 private:
  Vec6 usual_rate() const;

  SE3 last_;
  std::optional<std::int64_t> last_stamp_ns_;
  std::vector<Vec6> rates_;  ///< log(T_before_after) a second of the last steps, newest last.
};

}  // namespace sovo
