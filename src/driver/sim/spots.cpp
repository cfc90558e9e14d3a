#include "sovo/driver/sim/spots.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "sovo/driver/sim/kernel.h"

namespace sovo::sim {
namespace {

inline float log2_of(float x) {
  const auto bits = std::bit_cast<std::int32_t>(x);
  const auto exponent = static_cast<float>((bits >> 23) - 127);
  return exponent + std::bit_cast<float>((bits & 0x7FFFFF) | 0x3F800000) - 1.0F;
}

SOVO_SIM_KERNEL void cut_quad(const SurfaceView& view, const RayBatch& rays, int end,
                              Spots* spots) {
  const float n0 = view.n[0], n1 = view.n[1], n2 = view.n[2];
  const float u0 = view.u[0], u1 = view.u[1], u2 = view.u[2];
  const float v0 = view.v[0], v1 = view.v[1], v2 = view.v[2];
  Spots& s = *spots;
  for (std::size_t i = 0; i < static_cast<std::size_t>(end); ++i) {
    const float dx = rays.dx[i], dy = rays.dy[i], dz = rays.dz[i];
    s.cosine[i] = n0 * dx + n1 * dy + n2 * dz;
    s.along_x[i] = u0 * dx + u1 * dy + u2 * dz;
    s.along_y[i] = v0 * dx + v1 * dy + v2 * dz;
    s.x[i] = rays.range[i] * s.along_x[i];
    s.y[i] = rays.range[i] * s.along_y[i];
  }
}

/// The axes of a cylinder's surface change from place to place.
void cut_cylinder(const SurfaceView& view, const RayBatch& rays, int end, Spots* spots) {
  using Eigen::Vector3f;
  const Vector3f zero(view.u[0], view.u[1], view.u[2]);
  const Vector3f side(view.n[0], view.n[1], view.n[2]);
  const Vector3f axis(view.v[0], view.v[1], view.v[2]);
  const Vector3f centre(view.centre[0], view.centre[1], view.centre[2]);
  for (std::size_t i = 0; i < static_cast<std::size_t>(end); ++i) {
    const Vector3f ray(rays.dx[i], rays.dy[i], rays.dz[i]);
    const Vector3f p = rays.range[i] * ray - centre;
    const float height = p.dot(axis);
    const Vector3f n = (p - height * axis) / view.half_u;
    spots->x[i] = std::atan2(p.dot(side), p.dot(zero)) * view.half_u;
    spots->y[i] = height;
    spots->cosine[i] = n.dot(ray);
    spots->along_x[i] = axis.cross(n).dot(ray);
    spots->along_y[i] = axis.dot(ray);
  }
}

/// The ellipses and their probes from what the rays have along the surface's axes.
SOVO_SIM_KERNEL void measure(const RayBatch& rays, int end, Spots* spots) {
  Spots& s = *spots;
  for (std::size_t i = 0; i < static_cast<std::size_t>(end); ++i) {
    const float cosine = std::max(0.02F, std::abs(s.cosine[i]));
    const float du = s.along_x[i], dv = s.along_y[i];
    const float sine = std::sqrt(du * du + dv * dv);
    const float diameter = rays.range[i] * rays.angle[i];
    const float longer = diameter / cosine;
    const float stretch = longer / std::max(1e-4F, sine);
    s.long_x[i] = sine > 1e-4F ? du * stretch : longer;
    s.long_y[i] = sine > 1e-4F ? dv * stretch : 0.0F;
    const int probes = 1 + (cosine < 1.0F ? 1 : 0) + (cosine < 0.5F ? 1 : 0);
    s.probes[i] = probes;
    s.share[i] = 1.0F / static_cast<float>(probes);
    s.log_long[i] = log2_of(std::max(1e-9F, longer));
    s.log_probe[i] = log2_of(std::max(1e-9F, std::max(diameter, longer * s.share[i])));
  }
}

SOVO_SIM_KERNEL void rotate(const float* rotation, const RayBatch& rays, float ax, float ay,
                            Spots* __restrict s) {
  const float r0 = rotation[0], r1 = rotation[1], r2 = rotation[2];
  const float r3 = rotation[3], r4 = rotation[4], r5 = rotation[5];
  const float r6 = rotation[6], r7 = rotation[7], r8 = rotation[8];
  const float* const __restrict x = rays.dx.data();
  const float* const __restrict y = rays.dy.data();
  const float* const __restrict z = rays.dz.data();
  const auto end = static_cast<std::size_t>(s->end);
  for (std::size_t i = 0; i < end; ++i) {
    const float range = rays.range[i];
    s->world_x[i] = range * (r0 * x[i] + r1 * y[i] + r2 * z[i]);
    s->world_y[i] = range * (r3 * x[i] + r4 * y[i] + r5 * z[i]);
    s->world_z[i] = range * (r6 * x[i] + r7 * y[i] + r8 * z[i]);
    s->world_long_x[i] = ax * s->long_x[i] - ay * s->long_y[i];
    s->world_long_y[i] = ay * s->long_x[i] + ax * s->long_y[i];
  }
}

}  // namespace

float log2_linear(float x) { return log2_of(x); }

void find_spots(const SurfaceView& view, const Surface& surface, const RayBatch& rays, int end,
                Spots* spots) {
  spots->end = end;
  spots->foot_x = surface.texture_x;
  spots->foot_y = surface.texture_y;
  if (view.shape == Shape::kQuad) {
    spots->foot_x += view.foot_u;
    spots->foot_y += view.foot_v;
    cut_quad(view, rays, end, spots);
  } else {
    cut_cylinder(view, rays, end, spots);
  }
  measure(rays, end, spots);
}

void light_cylinder(const SurfaceView& view, const RayBatch& rays, const Eigen::Vector3f& to_sun,
                    float ambient, float sun, Spots* spots) {
  using Eigen::Vector3f;
  const Vector3f axis(view.v[0], view.v[1], view.v[2]);
  const Vector3f centre(view.centre[0], view.centre[1], view.centre[2]);
  const float sun_along = axis.dot(to_sun);
  for (std::size_t i = 0; i < static_cast<std::size_t>(spots->end); ++i) {
    const Vector3f p = rays.range[i] * Vector3f(rays.dx[i], rays.dy[i], rays.dz[i]) - centre;
    const float lit = (p.dot(to_sun) - p.dot(axis) * sun_along) / view.half_u;
    spots->light[i] = ambient * 0.8F + sun * std::max(0.0F, lit);
  }
}

void turn_to_world(const Mat3& R_world_camera, const Surface& surface, const RayBatch& rays,
                   Spots* spots) {
  std::array<float, 9> r;
  for (std::size_t i = 0; i < 9; ++i) {
    r[i] = static_cast<float>(
        R_world_camera(static_cast<Eigen::Index>(i / 3), static_cast<Eigen::Index>(i % 3)));
  }
  // Only level surfaces wear the world's patterns.
  const bool level = surface.n.z() > 0.9;
  rotate(r.data(), rays, level ? static_cast<float>(surface.u.x()) : 0.0F,
         level ? static_cast<float>(surface.u.y()) : 0.0F, spots);
}

}  // namespace sovo::sim
