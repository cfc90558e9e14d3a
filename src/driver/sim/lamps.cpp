#include "sovo/driver/sim/lamps.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sovo/driver/sim/exp_of_minus.h"

namespace sovo::sim {
namespace {

using Eigen::Vector3f;

constexpr float kNearest2 = 0.01F;  ///< No light comes from nearer than that, squared [m^2].
constexpr float kFarHaze = 20.0F;   ///< Beyond it haze sends nothing back [m].
constexpr int kScatterSteps = 12;   ///< Of the integral along a ray.

/// Light of one lamp through a square across its way.
float flux(const Lamps& lamps, const Lamp& lamp, const Vector3f& way, float distance) {
  const float cosine = way.dot(lamp.axis) / distance;
  const float lost = lamps.sharpness * (1.0F - cosine) + lamps.haze * distance;
  return lamps.power * exp_of_minus(lost) / std::max(kNearest2, distance * distance);
}

Vector3f ray_of(const RayBatch& rays, std::size_t i) {
  return {rays.dx[i], rays.dy[i], rays.dz[i]};
}

}  // namespace

float Lamps::on_surface(const Vector3f& point, const Vector3f& n, bool two_sided) const {
  float sum = 0.0F;
  for (const Lamp& lamp : lamps) {
    const Vector3f way = point - lamp.position;
    const float distance = std::max(1e-3F, way.norm());
    const float facing = -n.dot(way) / distance;
    sum += std::max(0.0F, two_sided ? std::abs(facing) : facing) * flux(*this, lamp, way, distance);
  }
  return sum;
}

float Lamps::at(const Vector3f& point) const {
  float sum = 0.0F;
  for (const Lamp& lamp : lamps) {
    const Vector3f way = point - lamp.position;
    sum += flux(*this, lamp, way, std::max(1e-3F, way.norm()));
  }
  return sum;
}

void Lamps::add_reflected(const SurfaceView& view, const RayBatch& rays, int end,
                          const BatchFloats& reflectance, BatchFloats* light) const {
  const Vector3f plane(view.n[0], view.n[1], view.n[2]);
  const Vector3f axis(view.v[0], view.v[1], view.v[2]);
  const Vector3f centre(view.centre[0], view.centre[1], view.centre[2]);
  for (std::size_t i = 0; i < static_cast<std::size_t>(end); ++i) {
    const Vector3f point = rays.range[i] * ray_of(rays, i);
    Vector3f n = plane;
    if (view.shape == Shape::kCylinder) {
      const Vector3f out = point - centre;
      n = (out - out.dot(axis) * axis) / view.half_u;
    }
    (*light)[i] += reflectance[i] * on_surface(point, n, view.two_sided);
  }
}

void Lamps::add_backscatter(const RayBatch& rays, int end, BatchFloats* light) const {
  if (!(haze * backscatter > 0.0F)) return;
  for (std::size_t i = 0; i < static_cast<std::size_t>(end); ++i) {
    const float range = std::min(kFarHaze, rays.range[i]);
    // Most comes from nearby: steps grow with the distance, s = range u^3.
    float sum = 0.0F;
    for (int k = 0; k < kScatterSteps; ++k) {
      const float u = (static_cast<float>(k) + 0.5F) / kScatterSteps;
      const float s = range * u * u * u;
      sum += u * u * at(s * ray_of(rays, i)) * exp_of_minus(haze * s);
    }
    (*light)[i] += backscatter * haze * sum * 3.0F * range / kScatterSteps;
  }
}

Lamps place_lamps(const LampConfig& config, const StereoRig& rig, Side side, double haze) {
  Lamps lamps;
  if (config.count == 0) return lamps;
  const SE3 T_camera_left = side == Side::kRight ? rig.T_right_left : SE3();
  // Above the middle between the cameras, in the left one's frame.
  const Vec3 middle = 0.5 * rig.T_right_left.inverse().translation() - Vec3(0, config.above_m, 0);
  for (int i = 0; i < config.count; ++i) {
    const double x = (i - 0.5 * (config.count - 1)) * config.spacing_m;
    const Vec3 position = T_camera_left * (middle + Vec3(x, 0, 0)).eval();
    const Vec3 axis = T_camera_left.rotation() * Vec3::UnitZ();
    lamps.lamps.push_back({position.cast<float>(), axis.cast<float>()});
  }
  const double half = 0.5 * config.beam_deg * std::numbers::pi / 180.0;
  lamps.power = 1.0F / static_cast<float>(config.count);
  lamps.sharpness = static_cast<float>(std::numbers::ln2 / (1.0 - std::cos(half)));
  lamps.haze = static_cast<float>(haze);
  lamps.backscatter = static_cast<float>(config.backscatter);
  return lamps;
}

float share_of_daylight(const LampConfig& config, double since_s) {
  if (config.count == 0) return 1.0F;
  const auto ramp = [&](double from_s) {
    if (!(config.fade_s > 0.0)) return since_s >= from_s ? 1.0 : 0.0;
    return std::clamp((since_s - from_s) / config.fade_s, 0.0, 1.0);
  };
  const double gone = ramp(config.ambient_from_s) - ramp(config.ambient_until_s);
  return static_cast<float>(std::pow(config.ambient, std::clamp(gone, 0.0, 1.0)));
}

}  // namespace sovo::sim
