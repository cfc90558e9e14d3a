#include "sovo/driver/sim/ray_table.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace sovo::sim {

RayTable::RayTable(const CameraModel& camera)
    : camera_(camera),
      tiles_x_((camera.width + kTile - 1) / kTile),
      tiles_y_((camera.height + kTile - 1) / kTile) {
  const std::size_t count = offset(num_tiles());
  for (auto* values : {&dx_, &dy_, &dz_, &angle_}) values->assign(count, 0.0F);
  for (auto& values : steps_) values.assign(count, 0.0F);
  if (bends()) {
    direction_.assign(count, Eigen::Vector3f::Zero());
    offset_.assign(count, 0.0F);
  }
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const auto ray = camera.unproject({x, y});
      if (!ray) continue;
      const std::size_t i = index(x, y);
      store_ray(i, ray->cast<float>());
      if (!bends()) continue;
      direction_[i] = ray->cast<float>();
      offset_[i] = static_cast<float>(camera.port->offset(*ray));
    }
  }
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const float area = ray_step_x(x, y).cross(ray_step_y(x, y)).norm();
      angle_[index(x, y)] = std::sqrt(std::max(1e-12F, area));
      store_pixel_step(x, y);
    }
  }
  for (int t = 0; t < num_tiles(); ++t) {
    cones_.push_back(cone_of(t % tiles_x_ * kTile, t / tiles_x_ * kTile, kTile));
  }
  constexpr int kBlockSide = kBlock * kTile;
  for (int b = 0; b < blocks_x() * blocks_y(); ++b) {
    blocks_.push_back(
        cone_of(b % blocks_x() * kBlockSide, b / blocks_x() * kBlockSide, kBlockSide));
  }
}

void RayTable::store_ray(std::size_t i, const Eigen::Vector3f& ray) {
  dx_[i] = ray.x();
  dy_[i] = ray.y();
  dz_[i] = ray.z();
}

/// Through the place on the true ray that is at that range.
void RayTable::bend(int tile_row, const float* range) {
  const Eigen::Vector3f normal = camera_.port->normal.cast<float>();
  const std::size_t end = offset((tile_row + 1) * tiles_x_);
  for (std::size_t i = offset(tile_row * tiles_x_); i < end; ++i) {
    const Eigen::Vector3f& direction = direction_[i];
    if (direction.isZero()) continue;
    if (range == nullptr || !std::isfinite(range[i])) {
      store_ray(i, direction);
      continue;
    }
    const Eigen::Vector3f begin = offset_[i] * normal;
    const float along = begin.dot(direction);
    const float aside2 = begin.squaredNorm() - along * along;
    const float length = std::sqrt(std::max(0.0F, range[i] * range[i] - aside2)) - along;
    store_ray(i, (begin + length * direction).normalized());
  }
}

Eigen::Vector3f RayTable::ray_step_x(int x, int y) const {
  const int a = std::max(0, x - 1);
  const int b = std::min(camera_.width - 1, x + 1);
  const Eigen::Vector3f r0 = ray(a, y);
  const Eigen::Vector3f r1 = ray(b, y);
  if (b == a || r0.isZero() || r1.isZero()) return Eigen::Vector3f::Zero();
  return (r1 - r0) / static_cast<float>(b - a);
}

Eigen::Vector3f RayTable::ray_step_y(int x, int y) const {
  const int a = std::max(0, y - 1);
  const int b = std::min(camera_.height - 1, y + 1);
  const Eigen::Vector3f r0 = ray(x, a);
  const Eigen::Vector3f r1 = ray(x, b);
  if (b == a || r0.isZero() || r1.isZero()) return Eigen::Vector3f::Zero();
  return (r1 - r0) / static_cast<float>(b - a);
}

/// The pseudo-inverse of the two columns of ray steps.
void RayTable::store_pixel_step(int x, int y) {
  const Eigen::Vector3f a = ray_step_x(x, y);
  const Eigen::Vector3f b = ray_step_y(x, y);
  const float aa = a.dot(a), ab = a.dot(b), bb = b.dot(b);
  const float determinant = aa * bb - ab * ab;
  if (!(determinant > 0.0F)) return;
  const Eigen::Vector3f px = (bb * a - ab * b) / determinant;
  const Eigen::Vector3f py = (aa * b - ab * a) / determinant;
  const std::size_t i = index(x, y);
  for (std::size_t k = 0; k < 3; ++k) {
    steps_[k][i] = px[static_cast<Eigen::Index>(k)];
    steps_[k + 3][i] = py[static_cast<Eigen::Index>(k)];
  }
}

RayCone RayTable::cone_of(int x0, int y0, int side) const {
  const int x1 = std::min(camera_.width, x0 + side);
  const int y1 = std::min(camera_.height, y0 + side);
  Vec3 sum = Vec3::Zero();
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) sum += ray(x, y).cast<double>();
  }
  RayCone cone;
  if (sum.norm() < 1e-6) return cone;
  const Vec3 axis = sum.normalized();
  double widest = 0.0;
  double pixel = 0.0;
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) {
      const Vec3 r = ray(x, y).cast<double>();
      if (r.isZero()) continue;
      widest = std::max(widest, std::acos(std::clamp(axis.dot(r), -1.0, 1.0)));
      pixel = std::max(pixel, double{angle_[index(x, y)]});
    }
  }
  // Rays through a pixel's corners belong to it, and those that a port bends for near things.
  constexpr double kBent = 0.1;
  const double angle = std::min(3.14, widest + 2.0 * pixel + (bends() ? kBent : 1e-4));
  for (int i = 0; i < 3; ++i) cone.axis[i] = static_cast<float>(axis[i]);
  cone.cos_angle = static_cast<float>(std::cos(angle));
  cone.sin_angle = static_cast<float>(std::sin(angle));
  cone.empty = false;
  return cone;
}

}  // namespace sovo::sim
