#include "sovo/driver/sim/own_body.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "sovo/driver/sim/random.h"

namespace sovo::sim {
namespace {

using Eigen::Vector3f;

/// What is within `radius` of the line from `a` to `b`, in the camera's frame [m].
struct Bar {
  Vector3f a, b;
  float radius;
  float tone;  ///< Of its paint.
};

/// Where a ray from the camera meets a bar.
struct Meeting {
  float range = 0.0F;
  Vector3f normal;
  float along = 0.0F;  ///< On the line from a [m].
  float round = 0.0F;  ///< Around it [m].
};

std::optional<Meeting> meet(const Bar& bar, const Vector3f& ray) {
  const Vector3f axis = (bar.b - bar.a).normalized();
  const float length = (bar.b - bar.a).norm();
  // |(r ray - a) x axis| = radius
  const Vector3f across = ray - ray.dot(axis) * axis;
  const Vector3f from = -bar.a + bar.a.dot(axis) * axis;
  const float a = across.squaredNorm();
  const float b = across.dot(from);
  const float root = b * b - a * (from.squaredNorm() - bar.radius * bar.radius);
  if (a < 1e-12F || root < 0.0F) return {};
  Meeting m;
  m.range = (-b - std::sqrt(root)) / a;
  if (m.range <= 0.0F) return {};
  const Vector3f point = m.range * ray;
  m.along = (point - bar.a).dot(axis);
  if (m.along < 0.0F || m.along > length) return {};
  m.normal = (point - bar.a - m.along * axis) / bar.radius;
  const Vector3f side = axis.unitOrthogonal();
  m.round = bar.radius * std::atan2(m.normal.dot(axis.cross(side)), m.normal.dot(side));
  return m;
}

/// Random values at whole places, interpolated between them; 0 to 1.
float value_noise(float x, float y, std::uint64_t seed) {
  const float x0 = std::floor(x);
  const float y0 = std::floor(y);
  const auto at = [&](int i, int j) {
    const auto column = static_cast<std::uint64_t>(static_cast<std::int64_t>(x0) + i);
    const auto row = static_cast<std::uint64_t>(static_cast<std::int64_t>(y0) + j);
    return static_cast<float>(unit(combine(combine(seed, column), row)));
  };
  const float fx = x - x0;
  const float fy = y - y0;
  return (1.0F - fy) * ((1.0F - fx) * at(0, 0) + fx * at(1, 0)) +
         fy * ((1.0F - fx) * at(0, 1) + fx * at(1, 1));
}

/// Paint with dirt on it, and rings of another tone.
float paint(const Bar& bar, const Meeting& m, float scale) {
  const float coarse = value_noise(m.along / scale, m.round / scale, 11);
  const float fine = value_noise(4.0F * m.along / scale, 4.0F * m.round / scale, 12);
  const float rings = std::fmod(m.along / (5.0F * scale), 1.0F) < 0.25F ? 0.6F : 1.0F;
  return bar.tone * rings * (0.6F + 0.5F * coarse + 0.3F * fine);
}

/// In the frame of the left camera, about the middle between both.
std::vector<Bar> bars_of(Body body, const Vec3& middle) {
  std::vector<Bar> bars;
  const auto add = [&](const Vec3& a, const Vec3& b, float radius, float tone) {
    bars.push_back({(middle + a).cast<float>(), (middle + b).cast<float>(), radius, tone});
  };
  if (body == Body::kBonnet) {
    add({-0.95, 1.45, 1.6}, {0.95, 1.45, 1.6}, 0.85F, 0.35F);
    add({-0.35, 0.72, 1.3}, {-0.3, 0.78, 1.5}, 0.02F, 0.15F);  // washers' nozzles
    add({0.3, 0.72, 1.3}, {0.35, 0.78, 1.5}, 0.02F, 0.15F);
  }
  if (body == Body::kArms) {
    for (const double side : {-1.0, 1.0}) {
      add({side * 0.34, 0.3, 0.1}, {side * 0.24, 0.2, 0.42}, 0.03F, 0.7F);
      add({side * 0.24, 0.2, 0.42}, {side * 0.08, 0.22, 0.62}, 0.025F, 0.45F);
      add({side * 0.08, 0.22, 0.62}, {side * 0.01, 0.19, 0.72}, 0.008F, 0.8F);
      add({side * 0.08, 0.22, 0.62}, {side * 0.02, 0.24, 0.72}, 0.008F, 0.8F);
    }
  }
  return bars;
}

}  // namespace

OwnBody::OwnBody(Body body, const StereoRig& rig, Side side, const RayTable& rays,
                 const Lamps& lamps)
    : lamps_(lamps) {
  const CameraModel& camera = rays.camera();
  num_pixels_ = static_cast<double>(camera.width) * camera.height;
  const SE3 T_camera_left = side == Side::kRight ? rig.T_right_left : SE3();
  std::vector<Bar> bars = bars_of(body, 0.5 * rig.T_right_left.inverse().translation());
  for (Bar& bar : bars) {
    bar.a = (T_camera_left * bar.a.cast<double>()).cast<float>();
    bar.b = (T_camera_left * bar.b.cast<double>()).cast<float>();
  }
  constexpr int kRays = 4;  // along each side of a pixel
  const float dirt = body == Body::kBonnet ? 0.06F : 0.02F;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Vector3f centre = rays.ray(x, y);
      if (centre.isZero()) continue;
      Pixel p{x, y, 0.0F, 0.0F, 0.0F, centre, Vector3f::Zero()};
      int count = 0;
      for (int k = 0; k < kRays * kRays; ++k) {
        const float dx = (static_cast<float>(k % kRays) + 0.5F) / kRays - 0.5F;
        const float dy = (static_cast<float>(k / kRays) + 0.5F) / kRays - 0.5F;
        const Vector3f ray =
            (centre + dx * rays.ray_step_x(x, y) + dy * rays.ray_step_y(x, y)).normalized();
        const Bar* nearest = nullptr;
        Meeting seen;
        for (const Bar& bar : bars) {
          const auto m = meet(bar, ray);
          if (!m || (nearest != nullptr && m->range >= seen.range)) continue;
          nearest = &bar;
          seen = *m;
        }
        if (nearest == nullptr) continue;
        ++count;
        p.range += seen.range;
        p.reflected += paint(*nearest, seen, dirt);
        p.normal += seen.normal;
      }
      if (count == 0) continue;
      p.covered = static_cast<float>(count) / (kRays * kRays);
      p.range /= static_cast<float>(count);
      p.reflected /= static_cast<float>(count);
      p.normal.normalize();
      pixels_.push_back(p);
    }
  }
}

void OwnBody::draw(const Daylight& daylight, ImageF* picture) const {
  for (const Pixel& p : pixels_) {
    const float sun = daylight.sun * std::max(0.0F, p.normal.dot(daylight.to_sun));
    float falls = daylight.ambient + sun;
    if (lamps_.lit()) falls += lamps_.on_surface(p.range * p.ray, p.normal, false);
    float& pixel = picture->at(p.x, p.y);
    pixel += p.covered * (p.reflected * falls * daylight.factor - pixel);
  }
}

void OwnBody::cover(ImageF* range) const {
  for (const Pixel& p : pixels_) {
    if (p.covered >= 0.5F) range->at(p.x, p.y) = p.range;
  }
}

std::optional<float> OwnBody::range_at(const Vec2& pixel) const {
  const auto place = std::pair(std::lround(pixel.y()), std::lround(pixel.x()));
  const auto at = [](const Pixel& p) { return std::pair<long, long>(p.y, p.x); };
  const auto p = std::ranges::lower_bound(pixels_, place, {}, at);
  if (p == pixels_.end() || at(*p) != place || p->covered < 0.5F) return {};
  return p->range;
}

double OwnBody::share() const {
  double covered = 0.0;
  for (const Pixel& p : pixels_) covered += double{p.covered};
  return covered / num_pixels_;
}

}  // namespace sovo::sim
