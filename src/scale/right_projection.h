#pragma once

#include "sovo/geometry/camera_model.h"
#include "sovo/scale/scale_points.h"

namespace sovo {

/// Positions in the right image and how they move with log-scale, one array a quantity.
struct ScaleProjections {
  AlignedVector<float> x, y;    ///< [px of the level]; far outside where there is no projection.
  AlignedVector<float> jx, jy;  ///< d(x, y) / d log-scale [px of the level].

  void resize(int padded);
};

/// The raw right camera, reduced to what projecting many points in single precision needs.
class RightProjection {
 public:
  explicit RightProjection(const CameraModel& camera);

  /// Projects all points at log-scale `sigma` into pyramid level `level`. Agrees with
  /// CameraModel::project to a few thousandths of a pixel.
  void project(const ScalePoints& points, double sigma, int level, ScaleProjections* out) const;

  /// Focal length along the rows [px].
  double focal() const { return camera_.fx; }

 private:
  CameraModel camera_;
  /// Where the distortion folds back: squared radius of the normalized plane (radtan), or angle
  /// to the optical axis (equidistant).
  float limit_;
};

}  // namespace sovo
