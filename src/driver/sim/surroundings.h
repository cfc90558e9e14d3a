#pragma once

#include <cmath>
#include <unordered_map>
#include <vector>

#include "sovo/driver/sim/motion.h"

namespace sovo::sim {

/// The ground plan of a motion: where it goes, so that nothing is put in its way.
class Footprint {
 public:
  explicit Footprint(const Motion& motion);

  /// Whether the motion comes nearer than `distance` (at most `kReach`) to (x, y).
  bool near(double x, double y, double distance) const;
  /// Whether it comes nearer than `distance` to any point of a turned rectangle.
  bool near_box(double x, double y, double yaw, double length, double width, double distance) const;
  /// Whether (x, y, z) is nearer than `distance` to the motion.
  bool near_point(const Vec3& point, double distance) const;

  const Vec3& low() const { return low_; }    ///< Smallest coordinates of the motion [m].
  const Vec3& high() const { return high_; }  ///< Largest coordinates of the motion [m].

  static constexpr double kReach = 12.0;  ///< [m]

 private:
  static std::int64_t cell(double x, double y) {
    const auto i = static_cast<std::int64_t>(std::floor(x / kReach));
    const auto j = static_cast<std::int64_t>(std::floor(y / kReach));
    return i * 1'000'003 + j;
  }

  /// Points of the motion by cells of side kReach.
  std::unordered_map<std::int64_t, std::vector<Vec3>> cells_;
  Vec3 low_;
  Vec3 high_;
};

}  // namespace sovo::sim
