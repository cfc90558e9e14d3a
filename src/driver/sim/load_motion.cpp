#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "sovo/driver/sim/world.h"

namespace sovo::sim {
namespace {

/// Which axis of the file's world is up, and which body its poses are of.
struct Convention {
  Vec3 up;            ///< In the file's world.
  Vec3 body_up;       ///< In the body.
  Vec3 body_forward;  ///< In the body.
  TrajectoryBody body;
};

const std::array<Convention, 4>& conventions() {
  static const std::array<Convention, 4> kAll = {{
      {Vec3::UnitZ(), -Vec3::UnitY(), Vec3::UnitZ(), TrajectoryBody::kCamera},
      {-Vec3::UnitY(), -Vec3::UnitY(), Vec3::UnitZ(), TrajectoryBody::kCamera},
      {Vec3::UnitZ(), Vec3::UnitX(), Vec3::UnitZ(), TrajectoryBody::kImuXUp},
      {Vec3::UnitZ(), Vec3::UnitZ(), Vec3::UnitX(), TrajectoryBody::kBase},
  }};
  return kAll;
}

/// How well a convention explains the poses: the body's upright axis is upright in the mean, and
/// the way is not straight up.
double plausibility(const Convention& convention, const Trajectory& poses) {
  Vec3 up = Vec3::Zero();
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity());
  Vec3 high = -low;
  for (const StampedPose& pose : poses) {
    up += pose.T_world_body.rotation().inverse() * convention.up;
    low = low.cwiseMin(pose.T_world_body.translation());
    high = high.cwiseMax(pose.T_world_body.translation());
  }
  const Vec3 extent = high - low;
  const double climb = std::abs(convention.up.dot(extent)) / std::max(1e-9, extent.norm());
  return up.dot(convention.body_up) / static_cast<double>(poses.size()) - climb;
}

Convention find_convention(const Trajectory& poses, TrajectoryBody wanted) {
  Convention best = conventions().front();
  double highest = -std::numeric_limits<double>::infinity();
  for (const Convention& convention : conventions()) {
    if (wanted != TrajectoryBody::kAuto && wanted != convention.body) continue;
    const double score = plausibility(convention, poses);
    if (score <= highest) continue;
    highest = score;
    best = convention;
  }
  return best;
}

/// The camera in the body. A calibration's own mounting is used for bodies with an inertial unit,
/// when it has one that is not REP-103's.
SE3 camera_in_body(const Convention& convention, const StereoRig& rig, bool calibrated) {
  if (convention.body == TrajectoryBody::kCamera) return {};
  const Vec3 mounted_down = rig.T_base_left.rotation() * Vec3::UnitY();
  if (calibrated && mounted_down.dot(convention.body_up) < -0.5) return rig.T_base_left;
  Mat3 r;
  r.col(1) = -convention.body_up;
  r.col(2) = convention.body_forward;
  r.col(0) = r.col(1).cross(r.col(2));
  return {r, Vec3::Zero()};
}

/// Turns the world so that its z axis is up.
SO3 upright(const Convention& convention) {
  if (convention.up.z() > 0.5) return {};
  Mat3 r;  // x forward (the old z), y to the left (the old -x), z up (the old -y)
  r << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return SO3(r);
}

/// Takes away slow changes of height: what remains moves about `height`.
void level(Trajectory* poses, double height) {
  const std::size_t count = poses->size();
  std::vector<double> way(count, 0.0);
  for (std::size_t i = 1; i < count; ++i) {
    const Vec3 step =
        (*poses)[i].T_world_body.translation() - (*poses)[i - 1].T_world_body.translation();
    way[i] = way[i - 1] + step.norm();
  }
  constexpr double kWindow = 10.0;  // [m] of the way to either side
  std::vector<double> slow(count);
  std::size_t first = 0;
  std::size_t last = 0;
  double sum = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    while (last < count && way[last] <= way[i] + kWindow) {
      sum += (*poses)[last++].T_world_body.translation().z();
    }
    while (way[first] < way[i] - kWindow) sum -= (*poses)[first++].T_world_body.translation().z();
    slow[i] = sum / static_cast<double>(last - first);
  }
  for (std::size_t i = 0; i < count; ++i) {
    double& z = (*poses)[i].T_world_body.translation().z();
    z += height - slow[i];
  }
}

double lowest(const Trajectory& poses) {
  double z = std::numeric_limits<double>::infinity();
  for (const StampedPose& p : poses) z = std::min(z, p.T_world_body.translation().z());
  return z;
}

/// Lifts the trajectory so that its lowest point is at `height`.
void lift(Trajectory* poses, double height) {
  const double by = height - lowest(*poses);
  for (StampedPose& p : *poses) p.T_world_body.translation().z() += by;
}

/// Ground is level and seen from above: a trajectory that changes its height faster than `level`
/// takes for slow would dive below it.
void level_above_ground(Trajectory* poses, double height) {
  constexpr double kLeast = 0.35;  // [m]
  level(poses, height);
  if (lowest(*poses) < kLeast) lift(poses, kLeast);
}

}  // namespace

Result<Motion> load_motion(const SimConfig& config, const StereoRig& rig) {
  auto poses = read_trajectory(config.trajectory, config.trajectory_times);
  if (!poses) return poses.failure();
  if (poses->size() < 2) {
    return Error{config.trajectory + ": has " + std::to_string(poses->size()) +
                 " poses; a trajectory needs two at least"};
  }
  const Convention convention = find_convention(*poses, config.trajectory_body);
  const SE3 mounting = camera_in_body(convention, rig, !config.calibration.empty());
  const SO3 turn = upright(convention);
  for (StampedPose& pose : *poses) {
    pose.T_world_body = SE3(turn, Vec3::Zero()) * pose.T_world_body * mounting;
  }
  const Vec3 start = poses->front().T_world_body.translation();
  for (StampedPose& pose : *poses) {
    pose.T_world_body.translation() -= Vec3(start.x(), start.y(), 0.0);
  }
  switch (config.world) {
    case World::kStreet:
    case World::kHighway:
      level_above_ground(&*poses, 1.65);
      break;
    case World::kLawn:
      level_above_ground(&*poses, 1.45);
      break;
    case World::kSand:
      level_above_ground(&*poses, 0.95);
      break;
    case World::kPool:
      lift(&*poses, 0.9);
      break;
    case World::kHall:
      lift(&*poses, 0.35);
      break;
  }
  return Motion(std::move(*poses));
}

}  // namespace sovo::sim
