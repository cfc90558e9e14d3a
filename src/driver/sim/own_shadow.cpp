#include "sovo/driver/sim/own_shadow.h"

#include <algorithm>
#include <cmath>

namespace sovo::sim {
namespace {

using Eigen::Vector3f;

constexpr float kSunRadius = 0.00465F;  ///< Of its disc [rad].

/// Least distance between a ray and the line from a to b, and how far along the ray that is [m].
struct Nearest {
  float distance = 0.0F;
  float along = 0.0F;
};

Nearest nearest(const Vector3f& from, const Vector3f& ray, const Vector3f& a, const Vector3f& b) {
  const Vector3f bar = b - a;
  const Vector3f to_a = a - from;
  const float across = ray.dot(bar);
  const float length2 = bar.squaredNorm();
  const float denominator = length2 - across * across;
  float w = 0.0F;  // where on the bar, 0 to 1
  if (denominator > 1e-9F) {
    w = std::clamp((across * ray.dot(to_a) - bar.dot(to_a)) / denominator, 0.0F, 1.0F);
  }
  const Vector3f on_bar = to_a + w * bar;
  const float along = std::max(0.0F, ray.dot(on_bar));
  return {(on_bar - along * ray).norm(), along};
}

}  // namespace

OwnShadow::OwnShadow(const StereoRig& rig, Side side) {
  const SE3 T_camera_left = side == Side::kRight ? rig.T_right_left : SE3();
  const Vec3 right = rig.T_right_left.inverse().translation();
  const Vec3 middle = 0.5 * right;
  const auto add = [&](const Vec3& a, const Vec3& b, float radius) {
    bars_.push_back({(T_camera_left * a).cast<float>(), (T_camera_left * b).cast<float>(), radius});
  };
  add({-0.05, 0.0, -0.05}, right + Vec3(0.05, 0.0, -0.05), 0.04F);               // housing
  add(middle + Vec3(0.0, 0.0, -0.06), middle + Vec3(0.0, 0.45, -0.25), 0.04F);   // mast
  add(middle + Vec3(-0.15, 0.5, -0.35), middle + Vec3(0.15, 0.5, -0.35), 0.2F);  // body
  add(middle + Vec3(-0.1, 0.42, -0.65), middle + Vec3(0.1, 0.42, -0.65), 0.2F);
}

float OwnShadow::hidden(const Vector3f& point, const Vector3f& to_sun) const {
  float light = 1.0F;
  for (const Bar& bar : bars_) {
    const Nearest n = nearest(point, to_sun, bar.a, bar.b);
    const float blur = std::max(1e-4F, kSunRadius * n.along);
    // The disc's share beyond a straight edge, as if it were a square.
    light *= 1.0F - std::clamp(0.5F + 0.5F * (bar.radius - n.distance) / blur, 0.0F, 1.0F);
  }
  return 1.0F - light;
}

}  // namespace sovo::sim
