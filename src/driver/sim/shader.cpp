#include "sovo/driver/sim/shader.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sovo/driver/sim/exp_of_minus.h"
#include "sovo/driver/sim/kernel.h"

namespace sovo::sim {

namespace {

/// Joins a layer's pattern with what lies below it.
SOVO_SIM_KERNEL void blend(const Layer& layer, float mean, int end, const float* __restrict pattern,
                           float* __restrict value) {
  const float a = layer.amplitude;
  switch (layer.blend) {
    case Blend::kAdd:
      for (int i = 0; i < end; ++i) value[i] += a * (pattern[i] - mean);
      break;
    case Blend::kMultiply:
      for (int i = 0; i < end; ++i) value[i] *= 1.0F + a * (pattern[i] - mean);
      break;
    case Blend::kMax:
      for (int i = 0; i < end; ++i) value[i] = std::max(value[i], a * pattern[i]);
      break;
    case Blend::kDarken:
      for (int i = 0; i < end; ++i) value[i] *= 1.0F - a * pattern[i];
      break;
  }
}

/// Darkens the lower ends of walls; `height`: of the camera over the ground.
SOVO_SIM_KERNEL void shade_feet(float strength, float height, int end,
                                const float* __restrict world_z, float* __restrict value) {
  for (int i = 0; i < end; ++i) {
    const float z = std::max(0.0F, height + world_z[i]);
    value[i] *= 1.0F - strength * exp_of_minus(1.6F * z);
  }
}

SOVO_SIM_KERNEL void add_haze(float haze, float colour, int end, const float* __restrict range,
                              float* __restrict value) {
  for (int i = 0; i < end; ++i) {
    value[i] = colour + exp_of_minus(haze * range[i]) * (value[i] - colour);
  }
}

/// Light of two nets, and where their lines cross.
SOVO_SIM_KERNEL void cross_nets(float strength, float mean, int end, const float* __restrict a,
                                const float* __restrict b, float* __restrict value) {
  for (int i = 0; i < end; ++i) {
    value[i] *= 1.0F + strength * (a[i] + b[i] + 3.0F * a[i] * b[i] - 2.0F * mean);
  }
}

}  // namespace

void Shader::update(const SE3& T_world_camera, double t) {
  T_world_camera_ = T_world_camera;
  R_world_camera_ = T_world_camera.rotation_matrix();
  to_sun_ = (R_world_camera_.transpose() * scene_->to_sun).cast<float>();
  time_ = t;
}

void Shader::reflect(const Material& material, const Spots& spots, BatchFloats* light) const {
  const SpotPlaces own{spots.foot_x, spots.foot_y,  &spots.x,
                       &spots.y,     &spots.long_x, &spots.long_y};
  const Vec3& camera = T_world_camera_.translation();
  const SpotPlaces world{camera.x(),     camera.y(),          &spots.world_x,
                         &spots.world_y, &spots.world_long_x, &spots.world_long_y};
  BatchFloats pattern;
  std::fill(light->begin(), light->begin() + spots.end, material.base);
  for (const Layer& l : material.layers) {
    const Texture& texture = scene_->textures[static_cast<std::size_t>(l.texture)];
    const PatternMap map{l.map, {l.velocity[0] * time_, l.velocity[1] * time_}, l.log_texels};
    look_up(texture, map, l.world ? world : own, spots, &pattern);
    blend(l, texture.mean(), spots.end, pattern.data(), light->data());
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(spots.end); ++i) {
    (*light)[i] = std::max(0.01F, (*light)[i]);
  }
}

/// Two nets of light that drift against each other.
void Shader::add_caustics(const Spots& spots, BatchFloats* light) const {
  const Texture& net = scene_->textures[static_cast<std::size_t>(scene_->caustics)];
  const Vec3& camera = T_world_camera_.translation();
  BatchFloats x, y, a, b;
  for (std::size_t i = 0; i < static_cast<std::size_t>(spots.end); ++i) {
    x[i] = spots.world_x[i] + 0.4F * spots.world_z[i];
    y[i] = spots.world_y[i] + 0.3F * spots.world_z[i];
  }
  const SpotPlaces places{camera.x() + 0.4 * camera.z(),
                          camera.y() + 0.3 * camera.z(),
                          &x,
                          &y,
                          &spots.world_long_x,
                          &spots.world_long_y};
  const double wobble = 0.05 * std::sin(1.1 * time_);
  const auto texels = static_cast<float>(net.size());
  look_up(net, {{0.31, 0.05, -0.05, 0.31}, {0.055 * time_, wobble}, log2_linear(0.31F * texels)},
          places, spots, &a);
  look_up(net,
          {{0.43, -0.11, 0.11, 0.43},
           {-0.05 * time_, 0.04 * time_ - wobble},
           log2_linear(0.44F * texels)},
          places, spots, &b);
  cross_nets(scene_->caustic_strength, net.mean(), spots.end, a.data(), b.data(), light->data());
}

/// Takes the sun's share of the light where the vehicle stands before it. `round`: where light
/// differs over a surface.
void Shader::add_own_shadow(const RayBatch& rays, float sun_and_sky, const Spots* round, int end,
                            BatchFloats* light) const {
  for (std::size_t i = 0; i < static_cast<std::size_t>(end); ++i) {
    const float all = round != nullptr ? round->light[i] : sun_and_sky;
    const float sun = 1.0F - std::min(1.0F, scene_->ambient / std::max(1e-6F, all));
    if (!(sun > 0.0F)) continue;
    const Eigen::Vector3f point =
        rays.range[i] * Eigen::Vector3f(rays.dx[i], rays.dy[i], rays.dz[i]);
    (*light)[i] *= 1.0F - sun * shadow_.hidden(point, to_sun_);
  }
}

void Shader::light(const SurfaceView& view, RayBatch* rays, BatchFloats* light) const {
  const Surface& s = scene_->surfaces[static_cast<std::size_t>(view.surface)];
  const Material& material = scene_->materials[static_cast<std::size_t>(s.material)];
  Spots spots;
  find_spots(view, s, *rays, rays->pad(), &spots);
  turn_to_world(R_world_camera_, s, *rays, &spots);
  reflect(material, spots, light);
  BatchFloats reflectance;
  const auto end = static_cast<std::size_t>(spots.end);
  if (lamps_.lit()) {
    for (std::size_t i = 0; i < end; ++i) reflectance[i] = s.tint * (*light)[i];
  }
  const bool round = view.shape == Shape::kCylinder;
  if (round) light_cylinder(view, *rays, to_sun_, scene_->ambient, scene_->sun, &spots);
  for (std::size_t i = 0; i < end; ++i) {
    (*light)[i] *= s.tint * (round ? spots.light[i] : s.light) * daylight_;
  }
  if (shadow_.falls()) {
    add_own_shadow(*rays, s.light, round ? &spots : nullptr, spots.end, light);
  }
  if (s.foot_shade > 0.0F) {
    const auto height = static_cast<float>(T_world_camera_.translation().z());
    shade_feet(s.foot_shade, height, spots.end, spots.world_z.data(), light->data());
  }
  if (scene_->caustics >= 0) add_caustics(spots, light);
  if (lamps_.lit()) lamps_.add_reflected(view, *rays, spots.end, reflectance, light);
  if (scene_->haze > 0.0) {
    add_haze(static_cast<float>(scene_->haze), daylight_ * scene_->haze_colour, spots.end,
             rays->range.data(), light->data());
  }
  if (lamps_.lit()) lamps_.add_backscatter(*rays, spots.end, light);
}

void Shader::cover(const SurfaceView& view, RayBatch* rays, BatchFloats* opacity) const {
  const Surface& s = scene_->surfaces[static_cast<std::size_t>(view.surface)];
  const Material& material = scene_->materials[static_cast<std::size_t>(s.material)];
  const Texture& texture = scene_->textures[static_cast<std::size_t>(material.opacity)];
  Spots spots;
  find_spots(view, s, *rays, rays->pad(), &spots);
  // Stretched over the surface.
  PatternMap map;
  map.map = {0.5 / s.half_u, 0.0, 0.0, 0.5 / s.half_v};
  map.shift = {0.5, 0.5};
  map.log_texels =
      log2_linear(static_cast<float>(texture.size() * 0.5 / std::sqrt(s.half_u * s.half_v)));
  const SpotPlaces places{spots.foot_x, spots.foot_y,  &spots.x,
                          &spots.y,     &spots.long_x, &spots.long_y};
  look_up(texture, map, places, spots, opacity);
  if (!s.decal) return;
  constexpr float kDecal = 0.62F;
  for (std::size_t i = 0; i < static_cast<std::size_t>(spots.end); ++i) (*opacity)[i] *= kDecal;
}

/// Two ranges of hills, the nearer one lower and darker.
float Shader::hills(double azimuth, double elevation, float pixel_angle, float beyond) const {
  const Texture& texture = scene_->textures[static_cast<std::size_t>(scene_->sky.hills)];
  float value = beyond;
  for (const int range : {0, 1}) {
    const double shift = 0.37 * range;
    const double where = azimuth * (0.5 / std::numbers::pi) * (3 + 2 * range) + shift;
    const float relief = texture.sample(where, 0.13 + 0.5 * range, 2.0F);
    const float top = scene_->sky.hill_height * (range == 0 ? 1.0F : 0.55F) * (0.25F + relief);
    const float edge = (top - static_cast<float>(elevation)) / pixel_angle + 0.5F;
    const float cover = std::clamp(edge, 0.0F, 1.0F);
    if (cover <= 0.0F) continue;
    const float level = log2_linear(pixel_angle * 4.0F * static_cast<float>(texture.size())) - 1.0F;
    const float wood = texture.sample(12.0 / std::numbers::pi * azimuth, elevation * 9.0, level);
    const float tone = range == 0 ? 0.5F + 0.22F * (wood - 0.5F) : 0.33F + 0.35F * (wood - 0.5F);
    value += cover * (tone - value);
  }
  return value;
}

float Shader::sky_of(const Eigen::Vector3f& ray, float pixel_angle) const {
  const Sky& sky = scene_->sky;
  const Vec3 d = R_world_camera_ * ray.cast<double>();
  const auto up = static_cast<float>(std::max(0.0, d.z()));
  float value = sky.horizon + (sky.zenith - sky.horizon) * std::sqrt(up);
  if (sky.clouds >= 0 && d.z() > 0.0) {
    const double scale = 0.35 / (d.z() + 0.12);
    const float stretch = static_cast<float>(scale) * pixel_angle / (up + 0.12F);
    const Texture& clouds = scene_->textures[static_cast<std::size_t>(sky.clouds)];
    const float level =
        log2_linear(std::max(1e-6F, stretch * static_cast<float>(clouds.size()))) + kLevelBias;
    const float cloud = clouds.sample(d.x() * scale, d.y() * scale, level);
    value += 0.8F * cloud * (1.0F - value);
  }
  if (sky.hills < 0) return value;
  const double elevation = std::asin(std::clamp(d.z(), -1.0, 1.0));
  if (elevation > sky.hill_height * 1.3 + 0.01) return value;
  return hills(std::atan2(d.y(), d.x()), elevation, pixel_angle, value);
}

void Shader::sky(RayBatch* rays, BatchFloats* light) const {
  for (std::size_t i = 0; i < static_cast<std::size_t>(rays->count); ++i) {
    (*light)[i] = daylight_ * sky_of({rays->dx[i], rays->dy[i], rays->dz[i]}, rays->angle[i]);
  }
  if (lamps_.lit()) lamps_.add_backscatter(*rays, rays->count, light);
}

}  // namespace sovo::sim
