#include "sovo/driver/sim/shader.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace sovo::sim {

namespace {

constexpr int kMaxProbes = 3;
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

/// Where a spot lies on a pattern.
struct PatternSpot {
  double u = 0.0, v = 0.0;             ///< [sides]
  float long_u = 0.0F, long_v = 0.0F;  ///< Long diameter [sides].
  float log_texels = 0.0F;             ///< log2 of texels per metre.
};

/// How a spot is cut into round ones, each looked up at its own resolution.
struct Probes {
  int count = 1;
  float log_long = 0.0F;   ///< log2 of the long diameter [m].
  float log_probe = 0.0F;  ///< log2 of the diameter of one [m].
};

/// Mean of a texture over a spot: samples along its long diameter, each as wide as the short one.
float sample_spot(const Texture& texture, const PatternSpot& spot, const Probes& probes) {
  TexturePlace place{texture_fraction(spot.u), texture_fraction(spot.v)};
  if (probes.log_long + spot.log_texels <= 0.0F) return texture.sample(place, 0.0F);
  const float level = probes.log_probe + spot.log_texels + kLevelBias;
  if (probes.count == 1) return texture.sample(place, level);
  if (level >= static_cast<float>(texture.num_levels() - 1)) return texture.mean();
  const float share = 1.0F / static_cast<float>(probes.count);
  const std::uint32_t du = texture_fraction(double{spot.long_u * share});
  const std::uint32_t dv = texture_fraction(double{spot.long_v * share});
  const double back = 0.5 * (probes.count - 1) * double{share};
  place.u -= texture_fraction(back * double{spot.long_u});
  place.v -= texture_fraction(back * double{spot.long_v});
  float sum = 0.0F;
  for (int i = 0; i < probes.count; ++i) {
    sum += texture.sample(place, level);
    place.u += du;
    place.v += dv;
  }
  return sum * share;
}

}  // namespace

/// The spot that a pixel sees of a surface: an ellipse.
struct Shader::Spot {
  double x = 0.0;  ///< On the surface [m].
  double y = 0.0;
  Vec3 world = Vec3::Zero();
  float long_x = 0.0F, long_y = 0.0F;              ///< Its long diameter on the surface [m].
  float world_long_x = 0.0F, world_long_y = 0.0F;  ///< The same over the world's x and y.
  Probes probes;
  float light = 1.0F;
};

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
  const float diameter = range * pixel_angle;
  const float longer = diameter / cosine;
  spot.long_x = sine > 1e-4F ? du / sine * longer : longer;
  spot.long_y = sine > 1e-4F ? dv / sine * longer : 0.0F;
  if (s.n.z() > 0.9) {  // only level surfaces wear the world's patterns
    const auto ax = static_cast<float>(s.u.x());
    const auto ay = static_cast<float>(s.u.y());
    spot.world_long_x = ax * spot.long_x - ay * spot.long_y;
    spot.world_long_y = ay * spot.long_x + ax * spot.long_y;
  }
  spot.probes.count = std::clamp(static_cast<int>(std::ceil(1.0F / cosine)), 1, kMaxProbes);
  spot.probes.log_long = log2_linear(std::max(1e-9F, longer));
  const float widest = longer / static_cast<float>(spot.probes.count);
  spot.probes.log_probe = log2_linear(std::max({1e-9F, diameter, widest}));
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
  const double lx = double{l.world ? p.world_long_x : p.long_x};
  const double ly = double{l.world ? p.world_long_y : p.long_y};
  PatternSpot spot;
  spot.u = l.map[0] * x + l.map[1] * y + l.velocity[0] * time_;
  spot.v = l.map[2] * x + l.map[3] * y + l.velocity[1] * time_;
  spot.long_u = static_cast<float>(l.map[0] * lx + l.map[1] * ly);
  spot.long_v = static_cast<float>(l.map[2] * lx + l.map[3] * ly);
  spot.log_texels = l.log_texels;
  return sample_spot(scene_->textures[static_cast<std::size_t>(l.texture)], spot, p.probes);
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
  const auto texels = static_cast<float>(net.size());
  PatternSpot spot;
  spot.u = 0.31 * x + 0.05 * y + 0.055 * time_;
  spot.v = 0.31 * y - 0.05 * x + wobble;
  spot.long_u = 0.31F * p.world_long_x;
  spot.long_v = 0.31F * p.world_long_y;
  spot.log_texels = log2_linear(0.31F * texels);
  const float a = sample_spot(net, spot, p.probes);
  spot.u = 0.43 * x - 0.11 * y - 0.05 * time_;
  spot.v = 0.43 * y + 0.11 * x + 0.04 * time_ - wobble;
  spot.long_u = 0.43F * p.world_long_x;
  spot.long_v = 0.43F * p.world_long_y;
  spot.log_texels = log2_linear(0.44F * texels);
  const float b = sample_spot(net, spot, p.probes);
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
    const Texture& texture = scene_->textures[static_cast<std::size_t>(material.opacity)];
    PatternSpot cover;
    cover.u = p.x * du + 0.5;
    cover.v = p.y * dv + 0.5;
    cover.long_u = static_cast<float>(du) * p.long_x;
    cover.long_v = static_cast<float>(dv) * p.long_y;
    cover.log_texels =
        log2_linear(static_cast<float>(texture.size() * 0.5 / std::sqrt(s.half_u * s.half_v)));
    sample.opacity = sample_spot(texture, cover, p.probes);
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
