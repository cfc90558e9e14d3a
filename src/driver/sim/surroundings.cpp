#include "sovo/driver/sim/surroundings.h"

#include <algorithm>
#include <limits>

namespace sovo::sim {

Footprint::Footprint(const Motion& motion)
    : low_(Vec3::Constant(std::numeric_limits<double>::infinity())), high_(-low_) {
  Vec3 last = Vec3::Constant(1e12);
  for (const StampedPose& pose : motion.samples()) {
    const Vec3& p = pose.T_world_body.translation();
    low_ = low_.cwiseMin(p);
    high_ = high_.cwiseMax(p);
    if ((p - last).norm() < 0.1) continue;
    last = p;
    cells_[cell(p.x(), p.y())].push_back(p);
  }
}

bool Footprint::near(double x, double y, double distance) const {
  for (const double dx : {-kReach, 0.0, kReach}) {
    for (const double dy : {-kReach, 0.0, kReach}) {
      const auto found = cells_.find(cell(x + dx, y + dy));
      if (found == cells_.end()) continue;
      for (const Vec3& p : found->second) {
        if (std::hypot(p.x() - x, p.y() - y) < distance) return true;
      }
    }
  }
  return false;
}

bool Footprint::near_point(const Vec3& point, double distance) const {
  for (const double dx : {-kReach, 0.0, kReach}) {
    for (const double dy : {-kReach, 0.0, kReach}) {
      const auto found = cells_.find(cell(point.x() + dx, point.y() + dy));
      if (found == cells_.end()) continue;
      for (const Vec3& p : found->second) {
        if ((p - point).norm() < distance) return true;
      }
    }
  }
  return false;
}

bool Footprint::near_box(double x, double y, double yaw, double length, double width,
                         double distance) const {
  const double c = std::cos(yaw);
  const double s = std::sin(yaw);
  // A grid fine enough that no pose slips between.
  const double step = std::max(0.5, 0.5 * distance);
  const int nu = std::max(1, static_cast<int>(std::ceil(length / step)));
  const int nv = std::max(1, static_cast<int>(std::ceil(width / step)));
  for (int i = 0; i <= nu; ++i) {
    for (int j = 0; j <= nv; ++j) {
      const double u = length * (static_cast<double>(i) / nu - 0.5);
      const double v = width * (static_cast<double>(j) / nv - 0.5);
      if (near(x + c * u - s * v, y + s * u + c * v, distance)) return true;
    }
  }
  return false;
}

}  // namespace sovo::sim
