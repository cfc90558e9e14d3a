#pragma once

#include "sovo/geometry/se3.h"
#include "sovo/odometry/dead_reckoning.h"
#include "sovo/odometry/map_segment.h"
#include "sovo/vo/monocular_backend.h"

namespace sovo {

/// Whether a frame that was tracked may be elsewhere all the same: it fits the map badly, after a
/// while in which the camera may have gone farther than tracking finds.
bool is_doubtful(const TrackedFrame& tracked, const DeadReckoning& reckoning);

/// Whether `found`, where a frame was recognized, is to be believed rather than `before`: what many
/// landmarks and the motion say counts more than how well pixels fit.
bool is_better(const TrackedFrame& found, const TrackedFrame& before, const ReckonedPose& expected);

/// Tracks the frame `tracked` once more from where it is recognized. If it fits the map there, and
/// better than where it was found, it is replaced, and true returned.
bool track_where(const SE3& T_odom_left, const DeadReckoning& reckoning, MapSegment* segment,
                 TrackedFrame* tracked);

}  // namespace sovo
