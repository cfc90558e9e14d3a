#pragma once

#include <vector>

#include "sovo/vo/coarse_tracker.h"
#include "sovo/vo/direct_config.h"
#include "sovo/vo/photometric_problem.h"
#include "sovo/vo/point_motion.h"
#include "sovo/vo/window.h"

namespace sovo {

/// Pixels of `camera` for one of a VGA image, in which the flows of `KeyframeConfig` are given.
double pixels_for_one_of_vga(const CameraModel& camera);

/// What a motion of points weighs; above 1 it makes a keyframe.
double motion_score(const KeyframeConfig& config, const CameraModel& camera,
                    const PointMotion& motion);

/// How a frame that was tracked compares with those before it.
struct TrackedHistory {
  double first_rmse = 0.0;  ///< Of the first frame tracked against this reference.
  bool blurred = false;     ///< Those shortly before were sharper.
  double frames = 1.0;      ///< Time since the reference over that since the last frame.
  bool young = false;       ///< The window has room for more keyframes.
};

/// Whether a tracked frame should become a keyframe. `motion`: of the reference's points, flows
/// clipped at `config.max_translation_flow`.
bool wants_keyframe(const KeyframeConfig& config, const CameraModel& camera,
                    const TrackingReference& reference, const TrackingResult& tracked,
                    const PointMotion& motion, double exposure_s, const TrackedHistory& history);

/// Marks the keyframes that are to leave the window when a new one enters: those with few points
/// left or another brightness, then the one that keeps the others best distributed (DSO, Sec. 3.1,
/// eq. 20). Call before the new keyframe is inserted.
void mark_leaving_keyframes(const KeyframeConfig& config, Window* window);

/// Points that leave the window, in two kinds.
struct LeavingPoints {
  std::vector<PointRef> marginalize;
  int dropped = 0;
};

/// Marks points for removal (`Point::remove`): of leaving hosts, without residuals, behind the
/// camera, or no longer seen; those with enough information are listed to be marginalized.
LeavingPoints mark_leaving_points(const WindowConfig& config, Window* window);

/// Erases all points that are marked.
void erase_marked_points(Window* window);

}  // namespace sovo
