#pragma once

#include "sovo/geometry/camera_model.h"
#include "sovo/geometry/types.h"

namespace sovo {

/// A lens beside what it was taken for: the ray that was taken to meet the normalized image at x
/// meets it at x (1 - focal - radial |x|^2). `focal` is how much longer the focal length is, as a
/// logarithm.
struct LensChange {
  double focal = 0.0;
  double radial = 0.0;

  Vec2 vector() const { return {focal, radial}; }
  static LensChange of(const Vec2& v) { return {v[0], v[1]}; }
};

/// A camera whose numbers are changed: focal lengths by the factor exp(`focal`), and `radial` added
/// to the first coefficient of its distortion; one without any gets radtan's.
CameraModel with_changed_numbers(const CameraModel& camera, const LensChange& numbers);

/// What a small change of those numbers does to the rays of a camera: LensChange of the rays is
/// this times that of the numbers, by least squares over its image. The identity for a pinhole; of
/// a fisheye lens or behind a port both mix.
Mat2 change_of_rays(const CameraModel& camera);

}  // namespace sovo
