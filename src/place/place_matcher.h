#pragma once

#include <optional>

#include "sovo/geometry/camera_model.h"
#include "sovo/place/place.h"

namespace sovo {

struct PlaceMatcherConfig {
  int max_hamming = 64;      ///< Bits of 256 in which two descriptors of one thing differ, at most.
  double max_ratio = 0.85;   ///< Of the best to the second-best number of bits.
  int min_inliers = 25;      ///< Landmarks that agree on one motion, at least.
  double sigma_px = 0.7;     ///< Of a keypoint's position, at its own level.
  int max_hypotheses = 300;  ///< Of RANSAC.
  /// What lies nearer than this in both images is left out: it may move along with the camera.
  double min_shift_px = 0.0;

  template <class Visitor>
  void visit(Visitor& v) {
    v("max_hamming", max_hamming, "bits of 256 in which descriptors of one thing differ, at most");
    v("max_ratio", max_ratio, "of the best to the second-best number of bits");
    v("min_inliers", min_inliers, "landmarks that agree on one motion, at least");
    v("sigma_px", sigma_px, "standard deviation of a keypoint's position [px of its level]");
    v("max_hypotheses", max_hypotheses, "motions that are tried");
    v("min_shift_px", min_shift_px,
      "what lies nearer than this in both images may move along, and is left out [px]");
  }
};

/// How two views of one place hang together.
struct PlaceMatch {
  SE3 T_a_b;
  /// Of (translation, rotation): the true one is exp(e) T_a_b.
  Mat6 covariance = Mat6::Zero();
  int inliers = 0;
  double support = 0.0;  ///< Share of a's landmarks that b should see which are inliers.
};

/// The motion between two views from their landmarks: RANSAC over triples of points (their two
/// triangles laid on one another), then Gauss-Newton on the reprojection errors in both images,
/// weighted with what pixels and depths err by. Nothing when too few agree. `camera`: a pinhole, of
/// both views.
std::optional<PlaceMatch> match_places(const CameraModel& camera, const Place& a, const Place& b,
                                       const PlaceMatcherConfig& config);

/// The same where about this motion is expected: pairs are sought where it has them, of which more
/// are right.
std::optional<PlaceMatch> match_places_near(const CameraModel& camera, const Place& a,
                                            const Place& b, const SE3& T_a_b,
                                            const PlaceMatcherConfig& config);

/// A landmark of one view where the other sees it: what `motion_between` fits.
struct LandmarkPair {
  const Landmark* a = nullptr;
  const Landmark* b = nullptr;
};

/// Refines `T_a_b` on pairs, of which those count that fit within `max_sigmas`; how many these are
/// at the end, and the motion's covariance.
PlaceMatch refine_motion(const CameraModel& camera, const std::vector<LandmarkPair>& pairs,
                         const SE3& T_a_b, double sigma_px, double max_sigmas);

}  // namespace sovo
