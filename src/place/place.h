#pragma once

#include <cstdint>
#include <vector>

#include "sovo/geometry/se3.h"
#include "sovo/place/keypoint.h"

namespace sovo {

/// A keypoint, and how far away it is.
struct Landmark {
  Keypoint keypoint;
  float inverse_depth = 0.0F;  ///< 1 / z in its camera [1/m].
  float sigma = 0.0F;          ///< Its standard deviation [1/m]; 0: the depth is not known.

  bool has_depth() const { return sigma > 0.0F; }
};

/// A keyframe that is recognized when it is seen again.
struct Place {
  std::uint32_t segment = 0;
  std::uint32_t keyframe_id = 0;
  std::int64_t stamp_ns = 0;
  SE3 T_odom_left;  ///< When it was new.
  /// Covariance of T_odom_left since the segment began, as in OdometryOutput.
  Mat6 covariance = Mat6::Zero();
  double median_depth = 1.0;  ///< [m]
  std::vector<Landmark> landmarks;
};

}  // namespace sovo
