#pragma once

#include <optional>

#include "sovo/geometry/camera_model.h"
#include "sovo/geometry/so3.h"
#include "sovo/image/image.h"

namespace sovo {

/// Rotation between two frames (with gain and bias) from all pixels of one coarse level, by
/// Gauss-Newton from `start`. Returns the root mean square residual [grey levels]; infinity when
/// fewer than half of the pixels overlap.
double align_rotation(const ImageF& from, const ImageF& to, const CameraModel& camera,
                      const SO3& start, SO3* R_to_from);

/// The same when nothing is known of the rotation but that it turns by up to `reach` [rad] around
/// each axis from `around`: the one by which the images correlate best, aligned. Nothing when none
/// correlates by more than 0.3.
std::optional<SO3> search_rotation(const ImageF& from, const ImageF& to, const CameraModel& camera,
                                   const SO3& around, double reach);

}  // namespace sovo
