#include "sovo/geometry/view_shift.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sovo {

AxialRays AxialRays::of(const CameraModel& camera) {
  if (!camera.port) return {};
  auto grid = std::make_shared<Grid>();
  grid->normal = camera.port->normal;
  grid->reach = camera.port->distance + camera.port->thickness;
  const auto nodes = [](int pixels) {
    return static_cast<std::size_t>(std::ceil(static_cast<float>(pixels) * kPerPixel)) + 1;
  };
  const std::size_t rows = nodes(camera.height);
  grid->columns = nodes(camera.width);
  grid->last_x = std::nextafter(static_cast<float>(grid->columns - 1), 0.0F);
  grid->last_y = std::nextafter(static_cast<float>(rows - 1), 0.0F);
  for (std::size_t j = 0; j < rows; ++j) {
    for (std::size_t i = 0; i < grid->columns; ++i) {
      const Vec2 pixel(static_cast<double>(i), static_cast<double>(j));
      const Vec2 at = pixel / double{kPerPixel};
      const Vec3 ray((at.x() - camera.cx) / camera.fx, (at.y() - camera.cy) / camera.fy, 1.0);
      grid->offsets.push_back(static_cast<float>(camera.port->offset(ray)));
    }
  }
  AxialRays rays;
  rays.grid_ = std::move(grid);
  return rays;
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
  if (!host_rays_.none()) host_axial_ = split(R * host_rays_.normal(), t, host_rays_.reach());
  if (!target_rays_.none()) target_axial_ = split(-target_rays_.normal(), t, target_rays_.reach());
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
  if (!host_rays_.none()) add(host_axial_, host_rays_.offset(host_pixel.x(), host_pixel.y()), &out);
  if (!target_rays_.none()) {
    add(target_axial_, target_rays_.offset(target_pixel.x(), target_pixel.y()), &out);
  }
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
