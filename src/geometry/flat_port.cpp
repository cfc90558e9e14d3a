#include "sovo/geometry/flat_port.h"

#include <algorithm>
#include <cmath>

namespace sovo {

namespace {

constexpr double kGrazing = 0.01;  ///< Least cosine to the normal, in air: 89.4 degrees.

}  // namespace

bool FlatPort::is_possible() const {
  const auto within = [](double v, double least, double most) { return v >= least && v <= most; };
  return within(distance, 0.0, 0.5) && within(thickness, 0.0, 0.2) && within(glass, 1.0, 2.5) &&
         within(water, 1.0, 1.6) && within(normal.norm(), 1.0 - 1e-6, 1.0 + 1e-6) &&
         normal.z() > 0.9 && within(centre, -1.0, 1.0);
}

std::optional<Vec3> FlatPort::to_air(const Vec3& direction, Mat3* jacobian) const {
  // Snell's law keeps n sin(angle): what is along the pane grows by `water`, the length stays.
  const double n2 = water * water;
  const double along = direction.dot(normal);
  const double root2 = (1.0 - n2) * direction.squaredNorm() + n2 * along * along;
  if (along <= 0.0 || root2 <= kGrazing * kGrazing * direction.squaredNorm()) return std::nullopt;
  const double root = std::sqrt(root2);
  if (jacobian != nullptr) {
    const Vec3 d_root = ((1.0 - n2) * direction + n2 * along * normal) / root;
    *jacobian = water * Mat3::Identity() + normal * (d_root - water * normal).transpose();
  }
  return Vec3(water * direction + (root - water * along) * normal);
}

std::optional<Vec3> FlatPort::to_water(const Vec3& bearing) const {
  const double along = bearing.dot(normal);
  if (along < kGrazing) return std::nullopt;
  const Vec3 aside = (bearing - along * normal) / water;
  return Vec3(aside + std::sqrt(1.0 - aside.squaredNorm()) * normal);
}

double FlatPort::offset(const Vec3& direction) const {
  // Tangents of the angles in air and glass over that in water, by its square.
  const double along = direction.dot(normal);
  const double tan2 = direction.squaredNorm() / (along * along) - 1.0;
  const double n2 = water * water;
  const double g2 = glass * glass;
  constexpr double kLeast = kGrazing * kGrazing;  // where no light comes from, as at the border
  const double air = water / std::sqrt(std::max(kLeast, 1.0 + (1.0 - n2) * tan2));
  const double pane = water / std::sqrt(std::max(kLeast, g2 + (g2 - n2) * tan2));
  return distance * (1.0 - air) + thickness * (1.0 - pane) - centre;
}

}  // namespace sovo
