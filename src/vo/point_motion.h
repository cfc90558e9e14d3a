#pragma once

#include "sovo/geometry/types.h"
#include "sovo/vo/tracking_reference.h"

namespace sovo {

/// How a motion moves the points of a reference in the image.
struct PointMotion {
  double flow_translation = 0.0;  ///< RMS flow without the rotation [px].
  double flow_total = 0.0;        ///< RMS flow [px].
  /// Mean motion along the view, to and fro alike, in the points' depths, of which near ones count
  /// more where they are few.
  double approach = 0.0;
};

/// That of `T_current_reference` (the flows as in DSO, Sec. 3.1, "keyframe creation"). What the
/// translation adds to a point's flow counts as `max_translation` [px] at most: a few near points
/// that pass by would else stand for all the others.
PointMotion motion_of_points(const ReferenceLevel& points, const SE3& T_current_reference,
                             double max_translation);

}  // namespace sovo
