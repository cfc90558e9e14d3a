#pragma once

#include <vector>

#include "sovo/vo/window.h"

namespace sovo {

/// An inlier as its host shows it and as the newest keyframe does. Grey levels are means over its
/// pattern, as large as it is in either image.
struct PointSight {
  double u_host = 0.0, v_host = 0.0, grey_host = 0.0;  ///< [px, px, grey levels]
  double u = 0.0, v = 0.0, grey = 0.0;                 ///< In the newest keyframe.
  double depth_ratio = 1.0;  ///< Along the optical axes: in the newest keyframe over the host.
};

/// By host, in the order of the window.
using PointSights = std::vector<std::vector<PointSight>>;

/// What the newest keyframe shows of the points of the others, in the memory of what `sights` was.
void find_sights_in_newest(const Window& window, PointSights* sights);

}  // namespace sovo
