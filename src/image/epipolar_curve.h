#pragma once

#include <Eigen/LU>
#include <optional>
#include <utility>

#include "sovo/geometry/camera_model.h"
#include "sovo/geometry/stereo_rig.h"

namespace sovo {

/// A point of an epipolar curve, with what a correlation there needs to know.
struct CurvePoint {
  Vec2 pixel;             ///< In the target image, level 0.
  Vec2 derivative;        ///< d pixel / d inverse depth [px m].
  Mat2 target_from_base;  ///< Small offsets of the base image into the target, surface facing us.
};

/// Where a pixel of one camera (the base) may appear in another (the target), as a function of
/// its inverse depth rho: the projection of infinity + rho * slope, whatever the distortion. Behind
/// a port the target's ray passes beside its origin, by what hardly depends on rho.
class EpipolarCurve {
 public:
  using Mat32 = Eigen::Matrix<double, 3, 2>;

  /// `infinity`: bearing of the pixel rotated into the target frame; rho = 1 / (distance in units
  /// of its length). `slope`: origin of the base camera in the target frame [m].
  /// `d_infinity`: derivative of `infinity` by the base pixel.
  EpipolarCurve(const CameraModel& target, Vec3 infinity, Vec3 slope, Mat32 d_infinity)
      : target_(&target),
        infinity_(std::move(infinity)),
        slope_(std::move(slope)),
        d_infinity_(std::move(d_infinity)),
        far_(target.port ? target.port->offset(infinity_) : 0.0) {}

  /// Nothing where the target camera cannot see the point. rho may be slightly negative.
  std::optional<CurvePoint> at(double rho) const {
    Mat23 jacobian;
    Vec3 slope = slope_;
    if (target_->port) slope -= offset_at(rho) * target_->port->normal;
    const auto pixel = target_->project(infinity_ + rho * slope, &jacobian);
    if (!pixel) return std::nullopt;
    return CurvePoint{*pixel, jacobian * slope, jacobian * d_infinity_};
  }

  const CameraModel& target() const { return *target_; }
  const Vec3& infinity() const { return infinity_; }
  const Vec3& slope() const { return slope_; }

 private:
  /// How the target's ray passes its origin, behind a port: two rounds from that of infinity, and
  /// where they lead to when steps shrink by equal shares (Aitken) [m].
  double offset_at(double rho) const {
    const FlatPort& port = *target_->port;
    const auto next = [&](double offset) {
      return port.offset(infinity_ + rho * (slope_ - offset * port.normal));
    };
    const double first = next(far_);
    const double second = next(first);
    const double step = second - first;
    const double bend = step - (first - far_);
    return second - step * step * bend / (bend * bend + 1e-20);
  }

  const CameraModel* target_;
  Vec3 infinity_;
  Vec3 slope_;
  Mat32 d_infinity_;
  double far_;  ///< Where the target is behind a port: how its ray to infinity passes [m].
};

/// Where a pixel of the left image, a pinhole's, may lie in the right one: X_right = R m + rho t,
/// where rho is 1 / z in the left frame; t is where the pixel's ray begins. `T_right_left`: that of
/// the rig, or between the instants at which the two images were exposed (StereoRig::moved).
inline EpipolarCurve right_curve(const StereoRig& rig, const SE3& T_right_left, const Vec2& pixel) {
  const Mat3 r = T_right_left.rotation_matrix();
  const Vec3 m((pixel.x() - rig.left.cx) / rig.left.fx, (pixel.y() - rig.left.cy) / rig.left.fy,
               1.0);
  EpipolarCurve::Mat32 d_infinity;
  d_infinity << r.col(0) / rig.left.fx, r.col(1) / rig.left.fy;
  return {rig.right, r * m, T_right_left * rig.left.ray_offset(m), d_infinity};
}

/// Pixel of level 0 in the coordinates of pyramid level `level`.
inline Vec2 to_level(const Vec2& pixel, int level) {
  const double scale = 1.0 / (1 << level);
  return {(pixel.x() + 0.5) * scale - 0.5, (pixel.y() + 0.5) * scale - 0.5};
}

}  // namespace sovo
