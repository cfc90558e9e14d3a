#pragma once

#include "sovo/geometry/camera_model.h"
#include "sovo/geometry/se3.h"
#include "sovo/geometry/view_shift.h"

namespace sovo {

/// Where a landmark of a host keyframe is seen in another one, with its derivatives.
///
/// The landmark is `ray / rho` in the host (ray: z = 1). Its position there times rho is used, for
/// what is infinitely far away has one, too: q = R_target_host ray + rho t_target_host, which is
/// projected to the same pixel.
struct Reprojection {
  Vec2 pixel;
  Mat26 d_target;  ///< By exp(x) T_target_world, (translation, rotation).
  Mat26 d_host;    ///< By exp(x) T_host_world.
  Vec2 d_rho;
  double depth_ratio = 1.0;  ///< Inverse depth in the target over rho.
};

/// False when the landmark is not in front of the target. `camera`: pinhole.
bool reproject(const CameraModel& camera, const SE3& T_target_host, const Vec3& ray, double rho,
               Reprojection* out);

/// The pixel alone.
bool reproject(const CameraModel& camera, const SE3& T_target_host, const Vec3& ray, double rho,
               Vec2* pixel);

/// The ray of a pixel of a pinhole camera, z = 1.
Vec3 ray_of(const CameraModel& camera, double u, double v);

/// What lies at `pixel`, `rho` near [1/m], by the camera's instant and centre: where it is seen by
/// a rolling shutter or through a port and, in `rho`, how near.
Vec2 seen_by_shift(const CameraModel& camera, const ViewShift& shift, const Vec2& pixel,
                   double* rho);

/// The ray at the camera's instant and from its centre of what is seen at (u, v), `rho` near, which
/// becomes that of the instant [1/m].
Vec3 ray_at_instant(const CameraModel& camera, const ViewShift& shift, double u, double v,
                    double* rho);

/// How the surroundings of `ray` are mapped into the target when they are as deep as it is:
/// d pixel' / d pixel by rows.
Mat2 surroundings(const CameraModel& camera, const SE3& T_target_host, const Vec3& ray, double rho);

}  // namespace sovo
