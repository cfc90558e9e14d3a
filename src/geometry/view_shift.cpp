#include "sovo/geometry/view_shift.h"

#include <algorithm>

namespace sovo {

std::optional<AxialRays> AxialRays::of(const CameraModel& camera) {
  if (!camera.port) return std::nullopt;
  return AxialRays{*camera.port, camera.fx, camera.fy, camera.cx, camera.cy};
}

PairViewShift::PairViewShift(const SE3& T_target_host, const ViewShift& host,
                             const ViewShift& target)
    : host_rays_(host.axial),
      target_rays_(target.axial),
      middle_(static_cast<float>(target.middle)),
      none_(host.none() && target.none()) {
  if (none_) return;
  const SO3& R = T_target_host.rotation();
  const Vec3& t = T_target_host.translation();
  const double rows = 2.0 * target.middle;
  host_ = split(-(R * host.per_row), t, rows);
  target_ = split(target.per_row, t, rows);
  const auto reach = [](const FlatPort& port) { return port.distance + port.thickness; };
  if (host_rays_) host_axial_ = split(R * host_rays_->port.normal, t, reach(host_rays_->port));
  if (target_rays_) {
    target_axial_ = split(-target_rays_->port.normal, t, reach(target_rays_->port));
  }
  if (t.squaredNorm() > 0.0) along_ = (t / t.squaredNorm()).cast<float>();
}

PairViewShift::Part PairViewShift::split(const Vec3& direction, const Vec3& t, double most) {
  // A way that is no longer than what is added to it says nothing of that.
  if (!(t.norm() > most * direction.norm()))
    return {0.0F, Eigen::Vector3f::Zero(), direction.cast<float>()};
  const double share = direction.dot(t) / t.squaredNorm();
  return {static_cast<float>(share), (direction - share * t).cast<float>(),
          Eigen::Vector3f::Zero()};
}

void PairViewShift::add(const Part& part, float weight, Displacement* to) const {
  to->share += weight * part.share;
  to->across += weight * part.across;
  to->fixed += weight * part.fixed;
}

PairViewShift::Displacement PairViewShift::at(const Eigen::Vector2f& host_pixel,
                                              const Eigen::Vector2f& target_pixel) const {
  Displacement out;
  out.along = along_;
  add(host_, host_pixel.y() - middle_, &out);
  add(target_, target_pixel.y() - middle_, &out);
  const auto offset = [](const AxialRays& rays, const Eigen::Vector2f& pixel) {
    return static_cast<float>(rays.offset(double{pixel.x()}, double{pixel.y()}));
  };
  if (host_rays_) add(host_axial_, offset(*host_rays_, host_pixel), &out);
  if (target_rays_) add(target_axial_, offset(*target_rays_, target_pixel), &out);
  return out;
}

PairViewShift::Displacement PairViewShift::at(const Eigen::Vector2f& host_pixel,
                                              const Eigen::Vector3f& seen, int width,
                                              int height) const {
  if (!(seen.z() > 0.0F)) return at(host_pixel, host_pixel);
  return at(host_pixel, {std::clamp(seen.x() / seen.z(), 0.0F, static_cast<float>(width)),
                         std::clamp(seen.y() / seen.z(), 0.0F, static_cast<float>(height))});
}

}  // namespace sovo
