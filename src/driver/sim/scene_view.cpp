#include "sovo/driver/sim/scene_view.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sovo/driver/sim/kernel.h"

namespace sovo::sim {
namespace {

constexpr float kNear = 0.02F;  ///< Nothing nearer is seen [m].

void store(const Vec3& from, float* to) {
  for (int i = 0; i < 3; ++i) to[i] = static_cast<float>(from[i]);
}

float dot(const float* a, const Eigen::Vector3f& b) {
  return a[0] * b.x() + a[1] * b.y() + a[2] * b.z();
}

SurfaceView view_of(const Surface& s, int index, const SE3& T_camera_world) {
  SurfaceView view;
  view.shape = s.shape;
  view.surface = index;
  view.two_sided = s.two_sided;
  view.unbounded = s.unbounded;
  const Vec3 centre = T_camera_world * s.centre;
  const Vec3 n = T_camera_world.rotation() * s.n;
  const Vec3 u = T_camera_world.rotation() * s.u;
  const Vec3 v = T_camera_world.rotation() * s.v;
  store(centre, view.centre);
  store(n, view.n);
  store(u, view.u);
  store(v, view.v);
  store(centre.cross(v), view.side);
  view.height = static_cast<float>(-n.dot(centre));
  view.along = static_cast<float>(v.dot(centre));
  view.foot_u = -u.dot(centre);
  view.foot_v = -v.dot(centre);
  view.half_u = static_cast<float>(s.half_u);
  view.half_v = static_cast<float>(s.half_v);
  view.distance = static_cast<float>(centre.norm());
  view.radius = static_cast<float>(std::hypot(s.half_u, s.half_v));
  view.nearest = std::max(0.0F, view.distance - view.radius);
  if (s.shape == Shape::kQuad) view.nearest = std::max(view.nearest, std::abs(view.height));
  return view;
}

SOVO_SIM_KERNEL void cover_quad(const SurfaceView& view, int index, const Rays& rays,
                                float* __restrict range, int* __restrict surface) {
  const float* const __restrict dx = rays.dx;
  const float* const __restrict dy = rays.dy;
  const float* const __restrict dz = rays.dz;
  const int count = rays.count;
  const float n0 = view.n[0], n1 = view.n[1], n2 = view.n[2];
  const float u0 = view.u[0], u1 = view.u[1], u2 = view.u[2];
  const float v0 = view.v[0], v1 = view.v[1], v2 = view.v[2];
  const auto fu = static_cast<float>(view.foot_u);
  const auto fv = static_cast<float>(view.foot_v);
  const float hu = view.half_u, hv = view.half_v, height = -view.height;
  for (int k = 0; k < count; ++k) {
    const float t = height / (n0 * dx[k] + n1 * dy[k] + n2 * dz[k]);
    const float x = fu + t * (u0 * dx[k] + u1 * dy[k] + u2 * dz[k]);
    const float y = fv + t * (v0 * dx[k] + v1 * dy[k] + v2 * dz[k]);
    // Not &&: its branches would keep the loop from being vectorized.
    const int hit = static_cast<int>(t > kNear) & static_cast<int>(t < range[k]) &
                    static_cast<int>(std::abs(x) <= hu) & static_cast<int>(std::abs(y) <= hv);
    range[k] = hit != 0 ? t : range[k];
    surface[k] = hit != 0 ? index : surface[k];
  }
}

SOVO_SIM_KERNEL void cover_cylinder(const SurfaceView& view, int index, const Rays& rays,
                                    float* __restrict range, int* __restrict surface) {
  const float* const __restrict dx = rays.dx;
  const float* const __restrict dy = rays.dy;
  const float* const __restrict dz = rays.dz;
  const int count = rays.count;
  const float a0 = view.v[0], a1 = view.v[1], a2 = view.v[2];
  const float c0 = view.centre[0], c1 = view.centre[1], c2 = view.centre[2];
  const float w0 = view.side[0], w1 = view.side[1], w2 = view.side[2];
  const float r2 = view.half_u * view.half_u, half = view.half_v, along = view.along;
  for (int k = 0; k < count; ++k) {
    const float ad = a0 * dx[k] + a1 * dy[k] + a2 * dz[k];
    const float a = 1.0F - ad * ad;
    const float b = c0 * dx[k] + c1 * dy[k] + c2 * dz[k] - ad * along;
    const float cross = w0 * dx[k] + w1 * dy[k] + w2 * dz[k];
    const float root = a * r2 - cross * cross;
    const float t = (b - std::sqrt(std::max(0.0F, root))) / a;
    const float y = t * ad - along;
    const bool hit = (root > 0.0F) & (t > kNear) & (t < range[k]) & (std::abs(y) <= half);
    range[k] = hit ? t : range[k];
    surface[k] = hit ? index : surface[k];
  }
}

}  // namespace

float range_along(const SurfaceView& view, const Eigen::Vector3f& d) {
  if (view.shape == Shape::kQuad) {
    const float t = -view.height / dot(view.n, d);
    if (!(t > kNear)) return kInfinity;
    const float x = static_cast<float>(view.foot_u) + t * dot(view.u, d);
    const float y = static_cast<float>(view.foot_v) + t * dot(view.v, d);
    return std::abs(x) <= view.half_u && std::abs(y) <= view.half_v ? t : kInfinity;
  }
  const float ad = dot(view.v, d);
  const float a = 1.0F - ad * ad;
  const float b = dot(view.centre, d) - ad * view.along;
  const float cross = dot(view.side, d);
  const float root = a * view.half_u * view.half_u - cross * cross;
  if (!(root > 0.0F)) return kInfinity;
  const float t = (b - std::sqrt(root)) / a;
  return t > kNear && std::abs(t * ad - view.along) <= view.half_v ? t : kInfinity;
}

void cover_rays(const SurfaceView& view, int index, const Rays& rays, float* range, int* surface) {
  if (view.shape == Shape::kQuad) {
    cover_quad(view, index, rays, range, surface);
  } else {
    cover_cylinder(view, index, rays, range, surface);
  }
}

void SceneView::add(std::size_t first, std::size_t last, const SE3& T_frame_camera) {
  const SE3 T_camera_frame = T_frame_camera.inverse();
  for (std::size_t i = first; i < last; ++i) {
    const Surface& s = scene_->surfaces[i];
    const bool away = s.n.dot(T_frame_camera.translation() - s.centre) <= 0.0;
    if (s.shape == Shape::kQuad && away && !s.two_sided) continue;
    const auto& material = scene_->materials[static_cast<std::size_t>(s.material)];
    (material.opacity < 0 ? solid_ : pierced_).push_back(static_cast<int>(views_.size()));
    views_.push_back(view_of(s, static_cast<int>(i), T_camera_frame));
  }
}

void SceneView::update(const SE3& T_world_camera, double t) {
  views_.clear();
  solid_.clear();
  pierced_.clear();
  const auto& movers = scene_->movers;
  add(0, movers.empty() ? scene_->surfaces.size() : movers.front().first, T_world_camera);
  for (const Mover& mover : movers) {
    const std::optional<SE3> T_world_mover = mover.place(t);
    if (T_world_mover) add(mover.first, mover.last, T_world_mover->inverse() * T_world_camera);
  }
  const auto at = [this](int i) -> const SurfaceView& {
    return views_[static_cast<std::size_t>(i)];
  };
  std::stable_sort(solid_.begin(), solid_.end(),
                   [&](int a, int b) { return at(a).nearest < at(b).nearest; });
  std::stable_sort(pierced_.begin(), pierced_.end(),
                   [&](int a, int b) { return at(a).distance < at(b).distance; });
}

void SceneView::select(const RayCone& cone, const std::vector<int>& from,
                       std::vector<int>* to) const {
  to->clear();
  if (cone.empty) return;
  for (const int i : from) {
    const SurfaceView& view = views_[static_cast<std::size_t>(i)];
    if (view.unbounded || view.distance <= view.radius) {
      to->push_back(i);
      continue;
    }
    // Within the cone widened by the angle phi under which the ball is seen.
    const float sin_phi = view.radius / view.distance;
    const float cos_phi = std::sqrt(1.0F - sin_phi * sin_phi);
    const float cosine = (cone.axis[0] * view.centre[0] + cone.axis[1] * view.centre[1] +
                          cone.axis[2] * view.centre[2]) /
                         view.distance;
    const bool wide = sin_phi * cone.cos_angle + cos_phi * cone.sin_angle <= 0.0F;  // over pi
    if (wide || cosine >= cone.cos_angle * cos_phi - cone.sin_angle * sin_phi) to->push_back(i);
  }
}

}  // namespace sovo::sim
