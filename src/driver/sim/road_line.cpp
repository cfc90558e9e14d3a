#include "sovo/driver/sim/road_line.h"

#include <cmath>

namespace sovo::sim {
namespace {

constexpr double kEndStep = 2.5;  ///< Of the straight ends [m].

WayPoint moved(WayPoint p, double along) {
  p.s += along;
  p.x += along * std::cos(p.heading);
  p.y += along * std::sin(p.heading);
  return p;
}

}  // namespace

std::vector<WayPoint> road_line(const Motion& motion, double before, double after) {
  std::vector<WayPoint> line;
  for (const StampedPose& pose : motion.samples()) {
    const Vec3& p = pose.T_world_body.translation();
    if (line.empty()) {
      const Vec3 ahead = pose.T_world_body.rotation() * Vec3::UnitZ();
      line.push_back({0.0, p.x(), p.y(), std::atan2(ahead.y(), ahead.x())});
      continue;
    }
    const WayPoint& last = line.back();
    const double step = std::hypot(p.x() - last.x, p.y() - last.y);
    if (step < 2.0) continue;
    line.push_back({last.s + step, p.x(), p.y(), std::atan2(p.y() - last.y, p.x() - last.x)});
  }
  const auto steps = [](double length) { return static_cast<int>(std::ceil(length / kEndStep)); };
  for (int i = 0; i < steps(after); ++i) line.push_back(moved(line.back(), kEndStep));
  for (int i = 0; i < steps(before); ++i) line.insert(line.begin(), moved(line.front(), -kEndStep));
  return line;
}

Vec3 beside(const WayPoint& p, double left, double z) {
  return {p.x - left * std::sin(p.heading), p.y + left * std::cos(p.heading), z};
}

WayPoint piece_of(const std::vector<WayPoint>& way, double s, double length) {
  const WayPoint a = place_on(way, s);
  const WayPoint c = place_on(way, s + length);
  WayPoint p = place_on(way, s + 0.5 * length);
  p.heading = std::atan2(c.y - a.y, c.x - a.x);
  return p;
}

}  // namespace sovo::sim
