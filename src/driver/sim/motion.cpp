#include "sovo/driver/sim/motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "sovo/geometry/stereo_rig.h"

namespace sovo::sim {

Motion::Motion(Trajectory samples) : samples_(std::move(samples)) {
  for (std::size_t i = 0; i < samples_.size(); ++i) velocities_.push_back(velocity_at(i));
}

double Motion::length_m() const {
  double length = 0.0;
  for (std::size_t i = 1; i < samples_.size(); ++i) {
    length += (samples_[i].T_world_body.translation() - samples_[i - 1].T_world_body.translation())
                  .norm();
  }
  return length;
}

Motion::Velocity Motion::velocity_at(std::size_t i) const {
  const auto between = [this](std::size_t a, std::size_t b) {
    const SE3& from = samples_[a].T_world_body;
    const SE3& to = samples_[b].T_world_body;
    const double dt = seconds(b) - seconds(a);
    return Velocity{(to.translation() - from.translation()) / dt,
                    (from.rotation().inverse() * to.rotation()).log() / dt};
  };
  if (i == 0) return between(0, 1);
  if (i + 1 == samples_.size()) return between(i - 1, i);
  // Of the parabola through three samples.
  const Velocity before = between(i - 1, i);
  const Velocity after = between(i, i + 1);
  const double w = (seconds(i) - seconds(i - 1)) / (seconds(i + 1) - seconds(i - 1));
  return {(1.0 - w) * before.linear + w * after.linear,
          (1.0 - w) * before.angular + w * after.angular};
}

SE3 Motion::at(double t) const {
  if (t <= 0.0) return samples_.front().T_world_body;
  if (t >= duration_s()) return samples_.back().T_world_body;
  const auto next = std::upper_bound(
      samples_.begin(), samples_.end(), t, [this](double value, const StampedPose& pose) {
        return value < 1e-9 * static_cast<double>(pose.stamp_ns - first_ns());
      });
  const auto i = static_cast<std::size_t>(next - samples_.begin()) - 1;
  const double dt = seconds(i + 1) - seconds(i);
  const double s = (t - seconds(i)) / dt;
  // Hermite polynomials of the end values and the velocities.
  const double h1 = s * s * (3.0 - 2.0 * s);
  const double g0 = s * (1.0 - s) * (1.0 - s) * dt;
  const double g1 = s * s * (s - 1.0) * dt;
  const SE3& a = samples_[i].T_world_body;
  const SE3& b = samples_[i + 1].T_world_body;
  const Vec3 position = a.translation() + h1 * (b.translation() - a.translation()) +
                        g0 * velocities_[i].linear + g1 * velocities_[i + 1].linear;
  const Vec3 turn = (a.rotation().inverse() * b.rotation()).log();
  // The body's angular velocity as that of the rotation vector: the right Jacobian's inverse.
  const Vec3 end_rate = SO3::left_jacobian_inverse(-turn) * velocities_[i + 1].angular;
  const Vec3 rotation = h1 * turn + g0 * velocities_[i].angular + g1 * end_rate;
  return {a.rotation() * SO3::exp(rotation), position};
}

std::vector<WayPoint> walk(const std::vector<Leg>& legs, double step) {
  std::vector<WayPoint> way{{}};
  for (const Leg& leg : legs) {
    const WayPoint begin = way.back();
    const int steps = std::max(1, static_cast<int>(std::ceil(leg.length / step)));
    const double ds = leg.length / steps;
    // The curvature is a raised cosine over the leg.
    const auto heading = [&](double u) {
      const double tau = 2.0 * std::numbers::pi;
      return begin.heading + leg.turn * (u - std::sin(tau * u) / tau);
    };
    for (int i = 0; i < steps; ++i) {
      const double middle = heading((i + 0.5) / steps);
      WayPoint point = way.back();
      point.s += ds;
      point.x += ds * std::cos(middle);
      point.y += ds * std::sin(middle);
      point.heading = heading((i + 1.0) / steps);
      way.push_back(point);
    }
  }
  return way;
}

WayPoint place_on(const std::vector<WayPoint>& way, double s) {
  if (s <= way.front().s) return way.front();
  if (s >= way.back().s) return way.back();
  const auto next = std::upper_bound(way.begin(), way.end(), s,
                                     [](double v, const WayPoint& p) { return v < p.s; });
  const WayPoint& b = *next;
  const WayPoint& a = *(next - 1);
  const double w = (s - a.s) / (b.s - a.s);
  const auto mix = [w](double p, double q) { return p + w * (q - p); };
  return {s, mix(a.x, b.x), mix(a.y, b.y), mix(a.heading, b.heading)};
}

SO3 looking(double heading, double down, double roll) {
  const SO3 level = SO3::exp(Vec3(0, 0, heading)) * body_from_optical().rotation();
  return level * SO3::exp(Vec3(-down, 0, 0)) * SO3::exp(Vec3(0, 0, roll));
}

}  // namespace sovo::sim
