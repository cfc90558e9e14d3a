#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "sovo/driver/sim/world.h"

namespace sovo::sim {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kSampleRate = 100.0;                       // [Hz]
constexpr std::int64_t kBegin = 1'577'836'800'000'000'000;  // 2020-01-01 UTC

/// Samples of `pose(t)` over `duration` seconds.
template <class Pose>
Motion sampled(double duration, Pose pose) {
  Trajectory samples;
  const int count = static_cast<int>(duration * kSampleRate);
  for (int i = 0; i <= count; ++i) {
    const double t = i / kSampleRate;
    samples.push_back({kBegin + static_cast<std::int64_t>(std::llround(1e9 * t)), pose(t)});
  }
  return Motion(std::move(samples));
}

/// How far one turn of a metre's length leads ahead and to its side.
WayPoint unit_turn(double turn) { return walk({{1.0, turn}}, 1e-3).back(); }

/// Speeds up from rest over the first seconds: way after `t` at `speed`.
double way_after(double t, double speed) {
  constexpr double kRamp = 1.5;
  return t < kRamp ? 0.5 * speed * t * t / kRamp : speed * (t - 0.5 * kRamp);
}

/// A walk around a square of 8 m, once, back to its start, as one carries a camera in the hand.
Motion walk_square() {
  constexpr double kSide = 8.0;
  constexpr double kSpeed = 1.0;
  // The curvature's peak is twice its mean, pi / 2 over the turn: 90 degrees a second at kSpeed.
  constexpr double kTurn = 2.0 * kSpeed;
  const WayPoint turn = unit_turn(0.5 * kPi);
  const double straight = kSide - 2.0 * kTurn * turn.x;
  std::vector<Leg> legs{{0.5 * straight, 0.0}};
  for (int i = 0; i < 4; ++i) {
    legs.push_back({kTurn, 0.5 * kPi});
    legs.push_back({i < 3 ? straight : 0.5 * straight, 0.0});
  }
  const auto way = walk(legs);
  const double duration = way.back().s / kSpeed + 0.75;
  return sampled(duration, [way](double t) {
    const double s = way_after(t, kSpeed);
    const WayPoint p = place_on(way, s);
    const double step = 2.0 * kPi * s / 1.4;  // two steps of 0.7 m
    const double sway = 0.02 * std::sin(step);
    const Vec3 position(p.x - sway * std::sin(p.heading), p.y + sway * std::cos(p.heading),
                        1.45 + 0.025 * std::sin(2.0 * step));
    const double yaw = p.heading + 0.02 * std::sin(step + 0.6) + 0.01 * std::sin(0.9 * t);
    const double down = 0.55 + 0.015 * std::sin(2.0 * step + 1.0) + 0.02 * std::sin(0.37 * t);
    return SE3(looking(yaw, down, 0.015 * std::sin(step + 2.0)), position);
  });
}

/// Lanes up and down a pool, 3.6 m apart.
Motion mow_pool() {
  constexpr double kLane = 3.6;
  constexpr double kLength = 16.0;
  constexpr double kSpeed = 0.6;
  const WayPoint turn = unit_turn(kPi);
  const double turn_length = kLane / turn.y;
  std::vector<Leg> legs;
  for (int i = 0; i < 4; ++i) {
    legs.push_back({kLength, 0.0});
    if (i < 3) legs.push_back({turn_length, i % 2 == 0 ? kPi : -kPi});
  }
  const auto way = walk(legs);
  return sampled(way.back().s / kSpeed + 0.75, [way](double t) {
    const WayPoint p = place_on(way, way_after(t, kSpeed));
    const Vec3 position(p.x, p.y, 1.25 + 0.12 * std::sin(0.31 * t) + 0.03 * std::sin(1.3 * t));
    const double yaw = p.heading + 0.03 * std::sin(0.8 * t);
    const double down = 0.75 + 0.03 * std::sin(0.6 * t + 1.0);
    return SE3(looking(yaw, down, 0.05 * std::sin(0.7 * t)), position);
  });
}

/// A drive of 470 m through a town, at up to 9 m/s, slower in the corners.
Motion drive_street() {
  const auto way = walk({{90.0, 0.0},
                         {40.0, 0.5},
                         {50.0, 0.0},
                         {28.0, -0.5 * kPi},
                         {70.0, 0.0},
                         {40.0, 0.4},
                         {40.0, -0.4},
                         {30.0, 0.5 * kPi},
                         {80.0, 0.0}},
                        0.1);
  // Time along the way, with a speed that follows the curvature.
  std::vector<double> times{0.0};
  double speed = 4.0;
  for (std::size_t i = 1; i < way.size(); ++i) {
    const double ds = way[i].s - way[i - 1].s;
    const std::size_t ahead = std::min(way.size() - 1, i + 80);
    const double bend = std::abs(way[ahead].heading - way[i].heading);
    const double wanted = 9.0 - 4.5 * std::min(1.0, bend / 0.6);
    speed += (wanted - speed) * 0.15 * ds;
    times.push_back(times.back() + ds / speed);
  }
  const double duration = times.back();
  return sampled(duration, [way, times](double t) {
    const auto next = std::upper_bound(times.begin(), times.end(), t);
    const auto i = std::min(static_cast<std::size_t>(next - times.begin()), times.size() - 1);
    const double w = (t - times[i - 1]) / (times[i] - times[i - 1]);
    const WayPoint p = place_on(way, way[i - 1].s + w * (way[i].s - way[i - 1].s));
    const double bounce = 0.012 * std::sin(0.9 * p.s) + 0.008 * std::sin(2.3 * p.s + 1.0);
    const double nod = 0.004 * std::sin(0.7 * p.s) + 0.003 * std::sin(1.9 * p.s);
    return SE3(looking(p.heading, 0.02 + nod, 0.005 * std::sin(0.5 * p.s)),
               {p.x, p.y, 1.65 + bounce});
  });
}

/// Loops of a small aircraft through a hall of about 20 m by 12 m.
Motion fly_hall() {
  const auto position = [](double t) {
    const double a = 0.26 * t;
    return Vec3(6.5 * std::sin(a) + 0.8 * std::sin(3.1 * a), 3.4 * std::sin(2.0 * a + 0.5),
                1.9 + 0.7 * std::sin(1.7 * a + 0.4) + 0.25 * std::sin(4.3 * a));
  };
  return sampled(60.0, [position](double t) {
    constexpr double h = 0.05;
    const Vec3 p = position(t);
    const Vec3 velocity = (position(t + h) - position(t - h)) / (2.0 * h);
    const Vec3 acceleration = (position(t + h) - 2.0 * p + position(t - h)) / (h * h);
    // It looks where it will be, and leans into its turns.
    const Vec3 ahead = position(t + 1.2) - position(t - 0.6);
    const double yaw = std::atan2(ahead.y(), ahead.x());
    const double side = -std::sin(yaw) * acceleration.x() + std::cos(yaw) * acceleration.y();
    const double forward = std::cos(yaw) * acceleration.x() + std::sin(yaw) * acceleration.y();
    const double roll = -std::atan(side / 9.81) + 0.015 * std::sin(5.0 * t);
    const double down =
        0.12 + std::atan(forward / 9.81) + 0.01 * std::sin(7.0 * t) + 0.02 * velocity.z();
    return SE3(looking(yaw, down, roll), p);
  });
}

CameraModel camera(double f, Distortion distortion, std::array<double, 4> d, double dx, double dy) {
  CameraModel c;
  c.width = 640;
  c.height = 400;
  c.fx = f;
  c.fy = f;
  c.cx = 319.5 + dx;
  c.cy = 199.5 + dy;
  c.distortion = distortion;
  if (distortion != Distortion::kNone) {
    for (std::size_t i = 0; i < d.size(); ++i) c.d[i] = d[i];
    c.num_coefficients = 4;
  }
  return c;
}

}  // namespace

Motion own_motion(World world) {
  switch (world) {
    case World::kLawn:
      return walk_square();
    case World::kPool:
      return mow_pool();
    case World::kStreet:
      return drive_street();
    case World::kHall:
      break;
  }
  return fly_hall();
}

StereoRig own_rig(World world) {
  StereoRig rig;
  rig.name = "sim_" + std::string(enum_names(world)[static_cast<std::size_t>(world)].second);
  const auto place_right = [&rig](double baseline, const Vec3& turn) {
    rig.T_right_left = SE3(SO3::exp(turn), Vec3(-baseline, 0.0, 0.0));
  };
  switch (world) {
    case World::kLawn:  // a stereo camera in the hand
      rig.left = camera(350.0, Distortion::kNone, {}, 0.0, 0.0);
      rig.right = camera(352.0, Distortion::kNone, {}, 3.0, -2.0);
      place_right(0.12, {0.004, -0.006, 0.003});
      break;
    case World::kPool:  // wide lenses behind flat glass
      rig.left = camera(300.0, Distortion::kEquidistant, {-0.012, 0.004, -0.003, 0.0006}, 2.0, 1.0);
      rig.right =
          camera(301.0, Distortion::kEquidistant, {-0.010, 0.003, -0.002, 0.0005}, -3.0, 2.0);
      place_right(0.18, {-0.003, 0.005, 0.002});
      break;
    case World::kStreet:  // rectified, on a car's roof
      rig.left = camera(380.0, Distortion::kNone, {}, 0.0, -20.0);
      rig.right = rig.left;
      place_right(0.5, Vec3::Zero());
      break;
    case World::kHall:  // on a small aircraft
      rig.left = camera(345.0, Distortion::kRadtan, {-0.283, 0.074, 0.0002, 0.00002}, -6.0, 5.0);
      rig.right = camera(344.0, Distortion::kRadtan, {-0.281, 0.073, -0.0001, 0.00003}, 5.0, 8.0);
      place_right(0.11, {0.007, 0.002, -0.004});
      break;
  }
  return rig;
}

double own_frame_rate(World world) {
  return world == World::kLawn || world == World::kHall ? 20.0 : 10.0;
}

}  // namespace sovo::sim
