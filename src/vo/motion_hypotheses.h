#pragma once

#include <span>
#include <vector>

#include "sovo/geometry/camera_model.h"
#include "sovo/geometry/se3.h"

namespace sovo {

/// Motions to try when none is known: `around` itself, then translations along each axis by these
/// shares of the mean depth, and rotations by a few degrees, all from there. `mean_rho`: mean
/// inverse depth [1/m].
std::vector<SE3> unknown_motions(const SE3& around, double mean_rho,
                                 std::span<const double> shares);

/// `around` and translations alone: as above across the optical axis, along it every `ahead` of the
/// mean depth, as far as the largest share.
std::vector<SE3> unknown_translations(const SE3& around, double mean_rho,
                                      std::span<const double> shares, double ahead);

/// `around` and translations from there on a grid: `steps` to either side along each axis, a `step`
/// of the mean depth apart.
std::vector<SE3> translations_around(const SE3& around, double mean_rho, double step, int steps);

/// Turns by up to `reach` around each axis [rad], dense enough for alignment on `level` to begin
/// from one of them: a pixel of it apart.
std::vector<SO3> turns(double reach, const CameraModel& level);

}  // namespace sovo
