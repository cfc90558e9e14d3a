#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
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

/// A drive along `way` at up to `fastest` m/s, slower by up to `slower` in the bends, braking
/// `foresight` metres ahead.
Motion drive(const std::vector<WayPoint>& way, double fastest, double slower, double foresight) {
  std::vector<double> times{0.0};
  double speed = 0.5 * fastest;
  const auto samples_ahead = static_cast<std::size_t>(foresight / (way[1].s - way[0].s));
  for (std::size_t i = 1; i < way.size(); ++i) {
    const double ds = way[i].s - way[i - 1].s;
    const std::size_t ahead = std::min(way.size() - 1, i + samples_ahead);
    const double bend = std::abs(way[ahead].heading - way[i].heading);
    const double wanted = fastest - slower * std::min(1.0, bend / 0.6);
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

/// 470 m through a town, at up to 9 m/s, slower in the corners.
Motion drive_town() {
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
  return drive(way, 9.0, 4.5, 8.0);
}

/// 600 m at up to 22 m/s through wide bends: few pairs see a point.
Motion drive_expressway() {
  const auto way =
      walk({{150.0, 0.0}, {140.0, 0.7}, {120.0, 0.0}, {110.0, -0.6}, {80.0, 0.0}}, 0.1);
  return drive(way, 22.0, 8.0, 20.0);
}

/// 1000 m of motorway at 29 m/s through bends of 500 m and more.
Motion drive_motorway() {
  const auto way =
      walk({{220.0, 0.0}, {260.0, 0.4}, {120.0, 0.0}, {280.0, -0.45}, {120.0, 0.0}}, 0.1);
  return drive(way, 29.0, 4.0, 30.0);
}

/// Off a motorway by a slip road: 370 m, from 25 m/s down to 13 in a bend to the right.
Motion drive_slip_road() {
  const auto way = walk({{110.0, 0.0}, {60.0, -0.15}, {130.0, -1.9}, {70.0, 0.0}}, 0.1);
  return drive(way, 25.0, 12.0, 30.0);
}

/// A flight of a small aircraft along the curve `path`, whose parameter at a time is `phase`: it
/// looks along the curve, and leans as it speeds up and turns.
template <class Path, class Phase>
Motion fly(double duration, Path path, Phase phase) {
  return sampled(duration, [=](double t) {
    constexpr double h = 0.05;
    const auto position = [&](double time) { return path(phase(time)); };
    const Vec3 p = position(t);
    const Vec3 velocity = (position(t + h) - position(t - h)) / (2.0 * h);
    const Vec3 acceleration = (position(t + h) - 2.0 * p + position(t - h)) / (h * h);
    // It looks where it will be.
    const Vec3 course = path(phase(t) + 2.2) - path(phase(t) - 1.8);
    const double yaw = std::atan2(course.y(), course.x());
    const double side = -std::sin(yaw) * acceleration.x() + std::cos(yaw) * acceleration.y();
    const double forward = std::cos(yaw) * acceleration.x() + std::sin(yaw) * acceleration.y();
    const double roll = -std::atan(side / 9.81) + 0.015 * std::sin(5.0 * t);
    const double down =
        0.12 + std::atan(forward / 9.81) + 0.01 * std::sin(7.0 * t) + 0.02 * velocity.z();
    return SE3(looking(yaw, down, roll), p);
  });
}

/// A closed curve through a hall of about 20 m by 12 m; once around is 24 units of `u`.
Vec3 loop_of_hall(double u) {
  const double a = 0.26 * u;
  return {6.5 * std::sin(a) + 0.8 * std::sin(3.1 * a), 3.4 * std::sin(2.0 * a + 0.5),
          1.9 + 0.7 * std::sin(1.7 * a + 0.4) + 0.25 * std::sin(4.3 * a)};
}

/// Loops at up to 3 m/s.
Motion fly_loops() {
  return fly(60.0, loop_of_hall, [](double t) { return t; });
}

/// Where the race is on the loops after `t` seconds: faster than `fly_loops`, then a
/// sudden end.
double phase_of_race(double t) {
  constexpr double kRamp = 2.0;    // [s]
  constexpr double kBrake = 26.0;  // [s]
  constexpr double kStop = 28.5;
  const double start = std::min(t, kRamp);
  const double brake = std::clamp(t, kBrake, kStop) - kBrake;
  const double run = std::min(t, kBrake) - start;
  return 1.4 * (0.5 * start * start / kRamp + run + brake - 0.5 * brake * brake / (kStop - kBrake));
}

/// Fast loops that end in standstill for the last six seconds.
Motion fly_race() { return fly(34.5, loop_of_hall, phase_of_race); }

/// From machine to machine, with a stop at each of them, looking around all the while.
Motion fly_inspection() {
  return sampled(60.0, [](double t) {
    constexpr double kStops = 0.5;  // [rad/s]
    const double a = 0.13 * (t - 0.97 * std::sin(kStops * t) / kStops);
    const Vec3 position(4.5 * std::sin(a), 2.6 * std::sin(2.0 * a + 0.4),
                        1.6 + 0.5 * std::sin(1.3 * a) + 0.02 * std::sin(1.1 * t));
    const double yaw = 1.9 * std::sin(0.9 * a + 0.3) + 0.35 * std::sin(0.27 * t);
    return SE3(looking(yaw, 0.1 + 0.08 * std::sin(0.4 * t), 0.03 * std::sin(0.9 * t)), position);
  });
}

/// A rover's round over sand, 43 m, which looks into every direction against the sun, pitching and
/// rolling as its wheels find the ground.
Motion drive_rover() {
  constexpr double kSpeed = 0.7;
  const auto way = walk({{6.0, 0.0},
                         {3.5, 0.5 * kPi},
                         {5.0, -0.3},
                         {3.0, 0.5 * kPi + 0.3},
                         {5.0, 0.2},
                         {2.5, 0.5 * kPi - 0.2},
                         {6.0, 0.4},
                         {4.0, -0.5 * kPi},
                         {8.0, 0.0}});
  return sampled(way.back().s / kSpeed + 0.75, [way](double t) {
    const WayPoint p = place_on(way, way_after(t, kSpeed));
    const double bump = std::sin(2.1 * p.s) + 0.6 * std::sin(4.7 * p.s + 1.0);
    const double tilt = std::sin(1.7 * p.s + 2.0) + 0.6 * std::sin(5.3 * p.s);
    const Vec3 position(p.x, p.y, 0.95 + 0.012 * std::sin(1.3 * p.s) + 0.006 * bump);
    const double down = 0.42 + 0.012 * bump;
    return SE3(looking(p.heading + 0.006 * tilt, down, 0.014 * tilt), position);
  });
}

struct NamedMotion {
  std::string name;
  Motion (*make)();
};

const std::vector<NamedMotion>& motions_of(World world) {
  static const std::vector<NamedMotion> kLawn{{"square", walk_square}};
  static const std::vector<NamedMotion> kPool{{"lanes", mow_pool}};
  static const std::vector<NamedMotion> kStreet{{"town", drive_town},
                                                {"expressway", drive_expressway}};
  static const std::vector<NamedMotion> kHall{
      {"loops", fly_loops}, {"inspection", fly_inspection}, {"race", fly_race}};
  static const std::vector<NamedMotion> kSand{{"traverse", drive_rover}};
  static const std::vector<NamedMotion> kHighway{{"motorway", drive_motorway},
                                                 {"slip", drive_slip_road}};
  switch (world) {
    case World::kLawn:
      return kLawn;
    case World::kPool:
      return kPool;
    case World::kStreet:
      return kStreet;
    case World::kHall:
      return kHall;
    case World::kHighway:
      return kHighway;
    case World::kSand:
      break;
  }
  return kSand;
}

}  // namespace

std::vector<std::string> own_trajectories(World world) {
  std::vector<std::string> names;
  for (const NamedMotion& motion : motions_of(world)) names.push_back(motion.name);
  return names;
}

Motion own_motion(World world, const std::string& name) {
  const auto& motions = motions_of(world);
  const auto found = std::find_if(motions.begin(), motions.end(),
                                  [&name](const NamedMotion& m) { return m.name == name; });
  return found == motions.end() ? motions.front().make() : found->make();
}

}  // namespace sovo::sim
