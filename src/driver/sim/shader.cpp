#include "sovo/driver/sim/shader.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace sovo::sim {

/// The spot that a pixel sees of a surface.
struct Shader::Spot {
  double x = 0.0;  ///< On the surface [m].
  double y = 0.0;
  Vec3 world = Vec3::Zero();
  /// Half axes' directions times lengths: the spot's long and short diameter on the surface [m].
  float long_x = 0.0F, long_y = 0.0F;
  float short_x = 0.0F, short_y = 0.0F;
  /// The same over the world's x and y.
  float world_long_x = 0.0F, world_long_y = 0.0F;
  float world_short_x = 0.0F, world_short_y = 0.0F;
  float diameter = 0.0F;  ///< Short one [m].
  float light = 1.0F;
};

namespace {

constexpr int kMaxProbes = 4;
/// Patterns are looked up a little softer than pixels are, as a lens does.
constexpr float kLevelBias = 0.25F;

/// Logarithm to base 2, linear between powers of two.
float log2_linear(float x) {
  const auto bits = std::bit_cast<std::uint32_t>(x);
  const auto exponent = static_cast<float>(static_cast<int>(bits >> 23) - 127);
  return exponent + std::bit_cast<float>((bits & 0x7FFFFFU) | 0x3F800000U) - 1.0F;
}

float dot(const float* a, const Eigen::Vector3f& b) {
  return a[0] * b.x() + a[1] * b.y() + a[2] * b.z();
}

/// Mean of a texture over a spot: samples along its long diameter, each as wide as the short one.
float sample_spot(const Texture& texture, double u, double v, float long_u, float long_v,
                  float short_u, float short_v) {
  const auto size = static_cast<float>(texture.size());
  float longer = std::sqrt(long_u * long_u + long_v * long_v);
  float shorter = std::sqrt(short_u * short_u + short_v * short_v);
  if (shorter > longer) {
    std::swap(longer, shorter);
    long_u = short_u;
    long_v = short_v;
  }
  const float texels = longer * size;
  const float ratio = std::min(texels, longer / std::max(shorter, 1e-9F));
  const int probes = std::clamp(static_cast<int>(std::ceil(ratio)), 1, kMaxProbes);
  const float width = std::max(shorter, longer / static_cast<float>(probes));
  const float level = log2_linear(std::max(1e-6F, width * size)) + kLevelBias;
  if (level >= static_cast<float>(texture.num_levels() - 1)) return texture.mean();
  if (probes == 1) return texture.sample(u, v, level);
  float sum = 0.0F;
  for (int i = 0; i < probes; ++i) {
    const float at = (static_cast<float>(i) + 0.5F) / static_cast<float>(probes) - 0.5F;
    sum += texture.sample(u + at * long_u, v + at * long_v, level);
  }
  return sum / static_cast<float>(probes);
}

}  // namespace

void Shader::update(const SE3& T_world_camera, double t) {
  T_world_camera_ = T_world_camera;
  R_world_camera_ = T_world_camera.rotation_matrix();
  to_sun_ = (R_world_camera_.transpose() * scene_->to_sun).cast<float>();
  time_ = t;
}

Shader::Spot Shader::spot(const SurfaceView& view, const Eigen::Vector3f& ray, float range,
                          float pixel_angle) const {
  const Surface& s = scene_->surfaces[static_cast<std::size_t>(view.surface)];
  Spot spot;
  spot.light = s.light;
  Eigen::Vector3f n(view.n[0], view.n[1], view.n[2]);
  Eigen::Vector3f u(view.u[0], view.u[1], view.u[2]);
  const Eigen::Vector3f v(view.v[0], view.v[1], view.v[2]);
  if (view.shape == Shape::kQuad) {
    spot.x = view.foot_u + double{range} * double{dot(view.u, ray)} + s.texture_x;
    spot.y = view.foot_v + double{range} * double{dot(view.v, ray)} + s.texture_y;
  } else {
    const Eigen::Vector3f p =
        range * ray - Eigen::Vector3f(view.centre[0], view.centre[1], view.centre[2]);
    const float around = std::atan2(p.dot(n), p.dot(u));
    spot.x = double{around * view.half_u} + s.texture_x;
    spot.y = double{p.dot(v)} + s.texture_y;
    n = (p - p.dot(v) * v) / view.half_u;
    u = v.cross(n);
    spot.light = scene_->ambient * 0.8F + scene_->sun * std::max(0.0F, n.dot(to_sun_));
  }
  const Vec3 ray_world = R_world_camera_ * ray.cast<double>();
  spot.world = T_world_camera_.translation() + double{range} * ray_world;
  const float cosine = std::max(0.02F, std::abs(n.dot(ray)));
  const float du = u.dot(ray);
  const float dv = v.dot(ray);
  const float sine = std::sqrt(du * du + dv * dv);
  const float cx = sine > 1e-4F ? du / sine : 1.0F;
  const float cy = sine > 1e-4F ? dv / sine : 0.0F;
  spot.diameter = range * pixel_angle;
  const float length = spot.diameter / cosine;
  spot.long_x = cx * length;
  spot.long_y = cy * length;
  spot.short_x = -cy * spot.diameter;
  spot.short_y = cx * spot.diameter;
  if (s.n.z() > 0.9) {  // only level surfaces wear the world's patterns
    const auto ax = static_cast<float>(s.u.x());
    const auto ay = static_cast<float>(s.u.y());
    spot.world_long_x = ax * spot.long_x - ay * spot.long_y;
    spot.world_long_y = ay * spot.long_x + ax * spot.long_y;
    spot.world_short_x = ax * spot.short_x - ay * spot.short_y;
    spot.world_short_y = ay * spot.short_x + ax * spot.short_y;
  } else {
    spot.world_long_x = length;
    spot.world_short_y = length;
  }
  if (s.foot_shade > 0.0F) {
    const double z = std::max(0.0, spot.world.z());
    spot.light *= 1.0F - s.foot_shade * static_cast<float>(std::exp(-1.6 * z));
  }
  spot.light *= s.tint;
  return spot;
}

float Shader::pattern(const Layer& l, const Spot& p) const {
  const double x = l.world ? p.world.x() : p.x;
  const double y = l.world ? p.world.y() : p.y;
  const auto m0 = static_cast<float>(l.map[0]);
  const auto m1 = static_cast<float>(l.map[1]);
  const auto m2 = static_cast<float>(l.map[2]);
  const auto m3 = static_cast<float>(l.map[3]);
  const float lx = l.world ? p.world_long_x : p.long_x;
  const float ly = l.world ? p.world_long_y : p.long_y;
  const float sx = l.world ? p.world_short_x : p.short_x;
  const float sy = l.world ? p.world_short_y : p.short_y;
  return sample_spot(scene_->textures[static_cast<std::size_t>(l.texture)],
                     l.map[0] * x + l.map[1] * y + l.velocity[0] * time_,
                     l.map[2] * x + l.map[3] * y + l.velocity[1] * time_, m0 * lx + m1 * ly,
                     m2 * lx + m3 * ly, m0 * sx + m1 * sy, m2 * sx + m3 * sy);
}

float Shader::reflected(const Material& material, const Spot& spot) const {
  float value = material.base;
  for (const Layer& l : material.layers) {
    const float s = pattern(l, spot);
    const float mean = scene_->textures[static_cast<std::size_t>(l.texture)].mean();
    switch (l.blend) {
      case Blend::kAdd:
        value += l.amplitude * (s - mean);
        break;
      case Blend::kMultiply:
        value *= 1.0F + l.amplitude * (s - mean);
        break;
      case Blend::kMax:
        value = std::max(value, l.amplitude * s);
        break;
      case Blend::kDarken:
        value *= 1.0F - l.amplitude * s;
        break;
    }
  }
  return std::max(0.01F, value);
}

/// Two nets of light that drift against each other.
float Shader::caustics(const Spot& p) const {
  const Texture& net = scene_->textures[static_cast<std::size_t>(scene_->caustics)];
  const double x = p.world.x() + 0.4 * p.world.z();
  const double y = p.world.y() + 0.3 * p.world.z();
  const double wobble = 0.05 * std::sin(1.1 * time_);
  const float a =
      sample_spot(net, 0.31 * x + 0.05 * y + 0.055 * time_, 0.31 * y - 0.05 * x + wobble,
                  0.31F * p.world_long_x, 0.31F * p.world_long_y, 0.31F * p.world_short_x,
                  0.31F * p.world_short_y);
  const float b =
      sample_spot(net, 0.43 * x - 0.11 * y - 0.05 * time_,
                  0.43 * y + 0.11 * x + 0.04 * time_ - wobble, 0.43F * p.world_long_x,
                  0.43F * p.world_long_y, 0.43F * p.world_short_x, 0.43F * p.world_short_y);
  return 1.0F + scene_->caustic_strength * (a + b + 3.0F * a * b - 2.0F * net.mean());
}

Shader::Sample Shader::surface(const SurfaceView& view, const Eigen::Vector3f& ray, float range,
                               float pixel_angle) const {
  const Surface& s = scene_->surfaces[static_cast<std::size_t>(view.surface)];
  const Material& material = scene_->materials[static_cast<std::size_t>(s.material)];
  const Spot p = spot(view, ray, range, pixel_angle);
  Sample sample;
  if (material.opacity >= 0) {
    const double du = 0.5 / s.half_u;
    const double dv = 0.5 / s.half_v;
    const auto fu = static_cast<float>(du);
    const auto fv = static_cast<float>(dv);
    sample.opacity =
        sample_spot(scene_->textures[static_cast<std::size_t>(material.opacity)], p.x * du + 0.5,
                    p.y * dv + 0.5, fu * p.long_x, fv * p.long_y, fu * p.short_x, fv * p.short_y);
    if (s.decal) sample.opacity *= 0.62F;
    if (sample.opacity < 0.004F) return {0.0F, 0.0F};
  }
  sample.value = p.light * reflected(material, p);
  if (scene_->caustics >= 0) sample.value *= caustics(p);
  if (scene_->haze > 0.0) {
    const float left = std::exp(-static_cast<float>(scene_->haze) * range);
    sample.value = scene_->haze_colour + left * (sample.value - scene_->haze_colour);
  }
  return sample;
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

float Shader::sky(const Eigen::Vector3f& ray, float pixel_angle) const {
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

}  // namespace sovo::sim
