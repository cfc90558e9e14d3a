#pragma once

#include <vector>

#include "sovo/geometry/camera_model.h"
#include "sovo/geometry/se3.h"

namespace sovo {

/// A landmark of the reference that was found in a frame.
struct FeatureMatch {
  SE3 T_reference_host;
  Vec3 ray;                ///< In the host, z = 1.
  double rho = 0.0;        ///< [1/m]
  double rho_sigma = 0.0;  ///< Its standard deviation [1/m].
  Vec2 pixel;              ///< Where it was found.
  double sigma = 1.0;      ///< Standard deviation of each coordinate [px].
};

/// A frame's pose by its matches.
struct FeaturePose {
  SE3 T_current_reference;
  std::vector<bool> inlier;  ///< By match.
  int inliers = 0;
  double rmse = 0.0;  ///< Of the inliers' reprojection errors [px].
  /// Of T_current_reference, left perturbation (translation, rotation).
  Mat6 covariance = Mat6::Zero();
};

/// The pose that minimizes Cauchy's loss of the reprojection errors, each over the covariance that
/// pixel and depth give it (Gauss-Newton from `start`). An inlier errs by less than
/// `outlier_sigmas` of it. `camera`: pinhole.
FeaturePose estimate_pose(const CameraModel& camera, const std::vector<FeatureMatch>& matches,
                          const SE3& start, double outlier_sigmas);

}  // namespace sovo
