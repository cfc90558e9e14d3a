#include "sovo/vo/point_motion.h"

#include <algorithm>
#include <cmath>

namespace sovo {

namespace {

constexpr std::size_t kLeastPoints = 256;  ///< Of more, every second, third, ... is looked at.
constexpr double kMostWeight = 4.0;        ///< Of a near point in the approach, over the mean.
constexpr double kNearShare = 0.75;        ///< What the approach weighted like that counts.

std::size_t stride_of(const ReferenceLevel& points) {
  return std::max<std::size_t>(1, points.size() / kLeastPoints);
}

Vec2 clipped(const Vec2& flow, double most) {
  const double length = flow.norm();
  return length > most ? Vec2(most / length * flow) : flow;
}

/// Mean of the points' motions along the view in their own depths; or, where that is more, a share
/// of the same weighted with inverse depths: on open roads most points are far and hardly move, and
/// the few near ones, which alone tell how far one went, leave the view before a mean of all calls
/// for a keyframe to follow them from.
double approach_of(const ReferenceLevel& points, double along_view) {
  const std::size_t stride = stride_of(points);
  double sum = 0.0;
  double n = 0.0;
  for (std::size_t i = 0; i < points.size(); i += stride, ++n) sum += points.rho[i];
  if (!(sum > 0.0)) return 0.0;
  const double most = kMostWeight * sum / n;
  double weighted = 0.0;
  double weights = 0.0;
  for (std::size_t i = 0; i < points.size(); i += stride) {
    const double weight = std::min<double>(points.rho[i], most);
    weighted += weight * points.rho[i];
    weights += weight;
  }
  return std::abs(along_view) * std::max(sum / n, kNearShare * weighted / weights);
}

}  // namespace

PointMotion motion_of_points(const ReferenceLevel& points, const SE3& T_current_reference,
                             double max_translation) {
  const std::size_t stride = stride_of(points);
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
    n += 2;
  }
  if (n == 0) return {};
  return {std::sqrt(sum.flow_translation / n), std::sqrt(sum.flow_total / n),
          approach_of(points, T_current_reference.translation().z())};
}

}  // namespace sovo
