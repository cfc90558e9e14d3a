#pragma once

#include <vector>

#include "sovo/driver/sim/motion.h"

namespace sovo::sim {

/// The line on the ground below a motion, in steps of two metres or more, which goes on straight
/// for `before` metres ahead of its start (s < 0) and `after` metres beyond its end, in steps of
/// 2.5 m.
std::vector<WayPoint> road_line(const Motion& motion, double before, double after);

/// The place `left` metres to the left of a point of a way, at the height `z`.
Vec3 beside(const WayPoint& p, double left, double z = 0.0);

/// The point in the middle of a piece of a way from `s` on, headed from its beginning to its end.
WayPoint piece_of(const std::vector<WayPoint>& way, double s, double length);

}  // namespace sovo::sim
