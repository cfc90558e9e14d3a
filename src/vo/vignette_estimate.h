#pragma once

#include <array>
#include <mutex>
#include <vector>

#include "sovo/geometry/types.h"
#include "sovo/image/vignette.h"
#include "sovo/vo/point_sights.h"
#include "sovo/vo/window.h"

namespace sovo {

/// A point as it is seen from two keyframes.
struct VignetteSight {
  Vec3 basis = Vec3::Zero();  ///< Of the vignette (RadialVignette::basis): in the target less host.
  /// Of the mean grey levels of its pattern, target to host, in images that are freed of the
  /// vignette as far as it was known.
  double log_ratio = 0.0;
  double log_known = 0.0;  ///< The same of what they were freed of.
  int quarter = 0;         ///< Of the target image: right, lower, left, upper.
};

/// The vignette of a camera whose calibration has none, found while flying: what is seen nearer to
/// a corner in one keyframe than in another is darker there.
///
/// The model is radial, as in Bergmann, Wang, Cremers, "Online photometric calibration of auto
/// exposure video for realtime visual odometry and SLAM" (2018); here it is the least-squares
/// solution of logarithms, from points whose places the window knows. Keyframes differ in
/// brightness besides, and what is seen in an image's quarters changes in its own way (the sky, the
/// road that comes nearer): logarithms are compared within each quarter of each pair of keyframes,
/// up to a constant.
class VignetteEstimate {
 public:
  /// `camera`: the tracked one, of whole images.
  explicit VignetteEstimate(const CameraModel& camera) : off_axis_(camera) {}

  /// Takes what is `seen` from the newest keyframe, after its bundle adjustment.
  void observe(const Window& window, const PointSights& seen);

  /// Takes the sights of the pairs of one keyframe.
  void observe(const std::vector<std::vector<VignetteSight>>& pairs);

  /// What images are to be freed of from now on. Any thread may ask.
  RadialVignette current() const;

 private:
  std::vector<VignetteSight> sights(const Window& window, int host,
                                    const std::vector<PointSight>& seen) const;
  void add(const std::vector<VignetteSight>& pair);
  void step();

  OffAxis off_axis_;
  // Least squares in the terms c of the vignette: H c = g.
  Mat3 H_ = Mat3::Zero();
  Vec3 g_ = Vec3::Zero();
  Vec3 terms_ = Vec3::Zero();

  mutable std::mutex mutex_;
  RadialVignette current_;
};

/// The least of c^T H c - 2 g^T c over c without a positive element. H: positive definite.
Vec3 solve_without_positive(const Mat3& H, const Vec3& g);

}  // namespace sovo
