#pragma once

#include "sovo/geometry/stereo_rig.h"
#include "sovo/image/image.h"
#include "sovo/vo/monocular_odometry.h"

namespace sovo {

/// A keyframe's points prepared for projection into the right camera at any scale s = e^sigma, one
/// array a quantity. With the rotated ray m = R K^-1 (u, v, 1), a point lies at
/// s m / rho + t in the right camera (paper, eq. 5), in the direction m + (rho / s) t.
///
/// Where the right image was exposed at another instant, m is the ray from where the left camera
/// was then: m = R (R' K^-1 (u, v, 1) + rho t') with T_later_left = (R', t'), whose length t' has
/// the unit of the points and so takes the same scale s.
///
/// Where the left camera looks through a port, a point's ray begins at o, beside its origin, and
/// the point lies at s m / rho + t + R o: not every point has the same translation.
///
/// Arrays are padded to a multiple of `kLanes` with points that are never visible.
struct ScalePoints {
  static constexpr int kLanes = 8;

  int size = 0;                            ///< Points with a usable depth.
  int padded = 0;                          ///< Length of the arrays.
  float t[3] = {0.0F, 0.0F, 0.0F};         ///< T_right_left's translation [m].
  float normal[3] = {0.0F, 0.0F, 0.0F};    ///< Of the left camera's port, in the right camera.
  AlignedVector<float> u, v;               ///< In the left image, level 0 [px].
  AlignedVector<float> mx, my, mz;         ///< Rotated ray of unit depth.
  AlignedVector<float> ray_offset;         ///< Of o along that normal [m]; 0 without a port.
  AlignedVector<float> inverse_depth;      ///< rho, of unscaled lengths.
  AlignedVector<float> relative_variance;  ///< (sigma_rho / rho)^2, not below a floor.
  AlignedVector<float> reference;          ///< Left grey level at the sampled pyramid level.
  AlignedVector<float> visible;            ///< 1, or 0 where padded or hidden by nearer points.

  /// Takes over the points of a keyframe; those without a positive finite depth are left out.
  void prepare(const KeyframeSnapshot& keyframe, const StereoRig& rig, const SE3& T_later_left,
               double min_relative_sigma);

  /// Translation of a point [m].
  Eigen::Vector3f translation(std::size_t i) const {
    return Eigen::Vector3f(t[0], t[1], t[2]) +
           ray_offset[i] * Eigen::Vector3f(normal[0], normal[1], normal[2]);
  }

  /// Turns the right camera about its own centre, by `turn` in its own frame [rad].
  void turn_right(const Vec3& turn);

  /// Every `stride`-th point of `all`.
  void take_every(int stride, const ScalePoints& all);

  /// Samples `reference` from the left image of pyramid level `level`.
  void sample_reference(const ImageF& left, int level);
};

}  // namespace sovo
