#include "sovo/vo/point_motion.h"

#include <algorithm>
#include <cmath>

namespace sovo {

namespace {

constexpr std::size_t kLeastPoints = 256;  ///< Of more, every second, third, ... is looked at.

Vec2 clipped(const Vec2& flow, double most) {
  const double length = flow.norm();
  return length > most ? Vec2(most / length * flow) : flow;
}

}  // namespace

PointMotion motion_of_points(const ReferenceLevel& points, const SE3& T_current_reference,
                             double max_translation) {
  const std::size_t stride = std::max<std::size_t>(1, points.size() / kLeastPoints);
  const Mat3 K = points.camera.matrix();
  const Mat3 KRKi = K * T_current_reference.rotation_matrix() * K.inverse();
  const Vec3 Kt = K * T_current_reference.translation();
  PointMotion sum;
  int n = 0;
  for (std::size_t i = 0; i < points.size(); i += stride) {
    const Vec3 p(points.u[i], points.v[i], 1.0);
    const Vec3 turned = KRKi * p;
    const Vec3 kt = Kt * points.rho[i];
    const Vec2 rotation = turned.hnormalized() - p.head<2>();
    for (const double sign : {1.0, -1.0}) {
      const Vec2 straight = (p + sign * kt).hnormalized() - p.head<2>();
      const Vec2 translation = (turned + sign * kt).hnormalized() - turned.hnormalized();
      sum.flow_translation += clipped(straight, max_translation).squaredNorm();
      sum.flow_total += (rotation + clipped(translation, max_translation)).squaredNorm();
    }
    sum.approach += 2.0 * std::abs(kt.z());
    n += 2;
  }
  if (n == 0) return {};
  return {std::sqrt(sum.flow_translation / n), std::sqrt(sum.flow_total / n), sum.approach / n};
}

}  // namespace sovo
