#pragma once

#include <cstdint>
#include <vector>

#include "sovo/io/trajectory_file.h"

namespace sovo::sim {

/// A motion through samples: it passes through each of them, position and orientation are cubic in
/// between and change their velocities without jumps (Hermite, velocities by Catmull-Rom).
class Motion {
 public:
  /// At least two samples whose stamps increase.
  explicit Motion(Trajectory samples);

  std::int64_t first_ns() const { return samples_.front().stamp_ns; }
  std::int64_t last_ns() const { return samples_.back().stamp_ns; }
  double duration_s() const { return 1e-9 * static_cast<double>(last_ns() - first_ns()); }
  /// Sum of the distances between samples [m].
  double length_m() const;

  /// Pose at `t` seconds after the first sample; held at both ends.
  SE3 at(double t) const;

  const Trajectory& samples() const { return samples_; }

 private:
  double seconds(std::size_t i) const {
    return 1e-9 * static_cast<double>(samples_[i].stamp_ns - samples_.front().stamp_ns);
  }
  /// Velocities at a sample: of the position, and of the orientation in the body's frame.
  struct Velocity {
    Vec3 linear = Vec3::Zero();
    Vec3 angular = Vec3::Zero();
  };
  Velocity velocity_at(std::size_t i) const;

  Trajectory samples_;
  std::vector<Velocity> velocities_;
};

/// A way over level ground: straight pieces and turns.
struct Leg {
  double length = 0.0;  ///< Along the way [m].
  double turn = 0.0;    ///< Change of heading on it, to the left [rad]; smooth at both ends.
};

/// Points of a way.
struct WayPoint {
  double s = 0.0;  ///< Length of the way so far [m].
  double x = 0.0, y = 0.0;
  double heading = 0.0;  ///< [rad]
};

/// The way along the legs from the origin, headed along x, in steps of at most `step` metres.
std::vector<WayPoint> walk(const std::vector<Leg>& legs, double step = 0.02);

/// Place on a way after the length `s`, linear between its points.
WayPoint place_on(const std::vector<WayPoint>& way, double s);

/// Orientation of a camera that looks along `heading`, `down` below the horizon, rolled to the
/// right by `roll` [rad], in a world with z up.
SO3 looking(double heading, double down, double roll);

}  // namespace sovo::sim
