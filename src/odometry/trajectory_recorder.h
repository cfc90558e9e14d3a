#pragma once

#include <vector>

#include "sovo/odometry/odometry_output.h"
#include "sovo/vo/monocular_backend.h"

namespace sovo {

/// Keeps how each frame hangs on its keyframe, and puts trajectories together from the keyframes'
/// refined poses when a segment is over.
class TrajectoryRecorder {
 public:
  /// A tracked frame of the segment at hand.
  void add(const TrackedFrame& tracked);

  /// Appends the frames of the segment at hand to `out` with their keyframes' poses. Each stamp is
  /// there once.
  void compose(const std::vector<KeyframePose>& keyframes, std::vector<TrajectoryPose>* out) const;

  /// Closes the segment at hand: its frames get their poses for good.
  void close_segment(const std::vector<KeyframePose>& keyframes);

  /// All segments so far, the one at hand composed from `keyframes` (may be null).
  std::vector<TrajectoryPose> trajectory(const std::vector<KeyframePose>* keyframes) const;

 private:
  struct FrameRecord {
    std::int64_t stamp_ns;
    std::uint32_t keyframe_id;
    SE3 T_left_keyframe;
    double log_scale;  ///< Sum of similarities that the reference had seen.
  };
  std::vector<TrajectoryPose> closed_;
  std::vector<FrameRecord> frames_;
};

/// Keyframes step by step from the first one (`KeyframePose::step`). Positions of the window would
/// not do: while it moves on, its scale drifts and is put right again, and what that moves far
/// behind it differs by when a keyframe left.
std::vector<SE3> refined_keyframe_poses(const std::vector<KeyframePose>& keyframes);

/// The same when only keyframes from `first` on have changed: `poses` keeps those before.
void refine_keyframe_poses(const std::vector<KeyframePose>& keyframes, std::size_t first,
                           std::vector<SE3>* poses);

}  // namespace sovo
