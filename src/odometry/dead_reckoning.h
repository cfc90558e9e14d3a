#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "sovo/geometry/se3.h"

namespace sovo {

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

  /// T_last_now: what it moves by `stamp_ns` from where it was noted last.
  SE3 since_last(std::int64_t stamp_ns) const;

 private:
  Vec6 usual_rate() const;

  SE3 last_;
  std::optional<std::int64_t> last_stamp_ns_;
  std::vector<Vec6> rates_;  ///< log(T_before_after) a second of the last steps, newest last.
};

}  // namespace sovo
