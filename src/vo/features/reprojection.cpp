#include "sovo/vo/features/reprojection.h"

namespace sovo {

namespace {

constexpr double kLeastDepth = 0.05;  ///< Of q, whose depth in the host is 1.

/// d pixel / d q.
Mat23 projection_jacobian(const CameraModel& camera, const Vec3& q) {
  const double iz = 1.0 / q.z();
  Mat23 J;
  J << camera.fx * iz, 0.0, -camera.fx * q.x() * iz * iz, 0.0, camera.fy * iz,
      -camera.fy * q.y() * iz * iz;
  return J;
}

Vec2 projected(const CameraModel& camera, const Vec3& q) {
  return {camera.fx * q.x() / q.z() + camera.cx, camera.fy * q.y() / q.z() + camera.cy};
}

}  // namespace

bool reproject(const CameraModel& camera, const SE3& T_target_host, const Vec3& ray, double rho,
               Reprojection* out) {
  const Mat3 R = T_target_host.rotation_matrix();
  const Vec3& t = T_target_host.translation();
  const Vec3 q = R * ray + rho * t;
  if (q.z() < kLeastDepth) return false;
  const Mat23 J = projection_jacobian(camera, q);
  out->pixel = projected(camera, q);
  out->d_target << rho * J, -J * hat(q);
  out->d_host << -rho * J * R, J * R * hat(ray);
  out->d_rho = J * t;
  out->depth_ratio = 1.0 / q.z();
  return true;
}

bool reproject(const CameraModel& camera, const SE3& T_target_host, const Vec3& ray, double rho,
               Vec2* pixel) {
  const Vec3 q = T_target_host.rotation() * ray + rho * T_target_host.translation();
  if (q.z() < kLeastDepth) return false;
  *pixel = projected(camera, q);
  return true;
}

Vec3 ray_of(const CameraModel& camera, double u, double v) {
  return {(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0};
}

Vec2 seen_by_shift(const CameraModel& camera, const ViewShift& shift, const Vec2& pixel,
                   double* rho) {
  if (shift.none()) return pixel;
  const Vec3 q = ray_of(camera, pixel.x(), pixel.y()) + *rho * shift.at(pixel.x(), pixel.y());
  if (q.z() < kLeastDepth) return pixel;
  *rho /= q.z();
  return projected(camera, q);
}

Vec3 ray_at_instant(const CameraModel& camera, const ViewShift& shift, double u, double v,
                    double* rho) {
  const Vec3 q = ray_of(camera, u, v) - *rho * shift.at(u, v);
  if (q.z() < kLeastDepth) return ray_of(camera, u, v);
  *rho /= q.z();
  return q / q.z();
}

Mat2 surroundings(const CameraModel& camera, const SE3& T_target_host, const Vec3& ray,
                  double rho) {
  const Mat3 R = T_target_host.rotation_matrix();
  const Vec3 q = R * ray + rho * T_target_host.translation();
  const Mat23 J = projection_jacobian(camera, q);
  Mat2 A;
  A << J * R.col(0) / camera.fx, J * R.col(1) / camera.fy;
  return A;
}

}  // namespace sovo
