#include "sovo/driver/sim/vehicles.h"

#include <cmath>

namespace sovo::sim {
namespace {

constexpr double kShadowHeight = 0.014;  ///< Above all pieces of the road [m].

}  // namespace

std::vector<int> car_paints(SceneBuilder& b, std::uint64_t seed) {
  std::vector<int> paints;
  for (unsigned i = 0; i < 5; ++i) {
    const int car = b.texture(car_pattern(256, seed + i));
    paints.push_back(b.material(0.0F, {stretched(car, 4.2, 0.95, Blend::kMax, 1.0F)}));
  }
  return paints;
}

void add_car(SceneBuilder& b, const VehicleMaterials& m, const Vec3& foot, double yaw) {
  const std::size_t first = b.box(foot, yaw, {4.2, 1.75, 0.85}, m.paint, m.paint);
  for (std::size_t i = first; i < first + 5; ++i) {
    Surface& s = b.scene().surfaces[i];
    s.texture_x = 2.1;
    s.texture_y = i == first + 4 ? 0.02 : 0.475;  // the top shows paint only
    s.foot_shade = 0.0F;
  }
  const Vec3 back(-0.25 * std::cos(yaw), -0.25 * std::sin(yaw), 0.85);
  b.box(foot + back, yaw, {2.3, 1.5, 0.52}, m.glass, m.paint);
  b.shadow(Vec3(foot.x(), foot.y(), kShadowHeight), yaw, 5.2, 2.7, m.shadow);
}

void add_lorry(SceneBuilder& b, const VehicleMaterials& m, const Vec3& foot, double yaw) {
  b.box(foot + Vec3(0.0, 0.0, 0.15), yaw, {7.4, 2.2, 0.6}, m.glass, m.glass);
  const std::size_t first = b.box(foot + Vec3(0, 0, 0.75), yaw, {8, 2.5, 2.65}, m.paint, m.paint);
  for (std::size_t i = first; i < first + 5; ++i) b.scene().surfaces[i].foot_shade = 0.0F;
  b.shadow(Vec3(foot.x(), foot.y(), kShadowHeight), yaw, 9.0, 3.5, m.shadow);
}

}  // namespace sovo::sim
