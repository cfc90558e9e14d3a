#pragma once

#include <cstdint>
#include <vector>

#include "sovo/geometry/se3.h"

namespace sovo {

/// The same scene point in two images, on the normalized image planes (z = 1).
struct Correspondence {
  double x0, y0;  ///< In the first view.
  double x1, y1;  ///< In the second view.
};

struct EpipolarPoseConfig {
  int hypotheses = 120;            ///< Minimal samples drawn.
  double inlier_px = 1.2;          ///< Largest Sampson distance of an inlier [px].
  int minimal_iterations = 6;      ///< Gauss-Newton steps from the start to a minimal solution.
  int refinement_iterations = 12;  ///< And to the solution from all inliers.

  template <class Visitor>
  void visit(Visitor& v) {
    v("hypotheses", hypotheses, "minimal samples drawn");
    v("inlier_px", inlier_px, "largest Sampson distance of an inlier [px]");
    v("minimal_iterations", minimal_iterations, "Gauss-Newton steps for a minimal sample");
    v("refinement_iterations", refinement_iterations, "Gauss-Newton steps with all inliers");
  }
};

/// Relative pose of two views with a translation of unit length.
struct EpipolarPose {
  bool valid = false;
  SE3 T_1_0;
  int inliers = 0;
  double cost = 0.0;             ///< Mean truncated squared Sampson distance [px^2].
  double rms_px = 0.0;           ///< Of the inliers' Sampson distances.
  double direction_sigma = 0.0;  ///< Standard deviation of the translation's direction [rad].
  std::vector<std::uint8_t> is_inlier;
};

/// Robust essential matrix: minimal samples of five correspondences, each solved by Gauss-Newton
/// over rotation and translation direction from `start` (whose translation may be zero: then, and
/// for most samples, from random directions), scored by truncated Sampson distance (MSAC), the
/// best refined over its inliers; sign of the translation by points in front of both views.
/// `focal` turns distances into pixels; `seed` makes the samples repeatable.
EpipolarPose estimate_epipolar_pose(const std::vector<Correspondence>& matches, double focal,
                                    const SE3& start, std::uint32_t seed,
                                    const EpipolarPoseConfig& config = {});

/// Rotation that best explains the correspondences without any translation, by iteratively
/// reweighted least squares from `start`; `cost`: mean squared distance, truncated at
/// `inlier_px`, `median_px`: median distance left.
SO3 estimate_rotation(const std::vector<Correspondence>& matches, double focal, const SO3& start,
                      double inlier_px, double* cost, double* median_px);

/// Inverse depth in the first view that minimises the distance in the second one [1 / |t|];
/// `sigma_per_px`: its standard deviation for an error of one pixel. Zero sigma: no parallax.
double triangulate_inverse_depth(const Correspondence& match, const SE3& T_1_0, double focal,
                                 double* sigma_per_px);

}  // namespace sovo
