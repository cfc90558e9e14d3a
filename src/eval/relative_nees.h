#pragma once

#include <cstdint>
#include <span>

#include "sovo/geometry/se3.h"
#include "sovo/io/trajectory_file.h"

namespace sovo {

/// A pose as it was published, with what was claimed about it.
struct UncertainPose {
  std::int64_t stamp_ns = 0;
  std::uint32_t segment = 0;  ///< Poses of two segments are not compared.
  SE3 T_odom_left;
  Mat6 covariance;        ///< Of (translation, rotation) in odom axes since the segment began.
  Mat6 frame_covariance;  ///< The part of it that later poses do not inherit.
};

/// Covariance of pose `j` as seen from the earlier pose `i`, in odom axes.
Mat6 relative_covariance(const UncertainPose& i, const UncertainPose& j);

/// Pairs of poses: the first so far apart in time and in way.
struct PairDistance {
  double seconds = 0.0;
  double metres = 0.0;
};

/// Mean of e^T C^-1 e / 6 over all pairs, e being the error of a relative pose: 1 when honest,
/// above when optimistic. A pair whose covariances do not differ by a positive definite matrix is
/// left out: what a scale that is hardly known adds to a pose near the start need not be in later
/// ones. NaN when there is no pair, or when more than one in ten is so.
double relative_nees(std::span<const UncertainPose> poses, const Trajectory& truth,
                     const PairDistance& distance);

}  // namespace sovo
