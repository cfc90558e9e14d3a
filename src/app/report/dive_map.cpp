#include "sovo/app/report/dive_map.h"

#include <cmath>
#include <cstdint>
#include <set>
#include <tuple>

#include "sovo/image/undistorter.h"

namespace sovo::app {
namespace {

constexpr double kLargestSigma = 0.1;  // Of an inverse depth, relative.
constexpr double kFarthest = 1e6;      // [m]

void add_points(const DiveKeyframe& keyframe, const CameraModel& camera, std::vector<Vec3>* out) {
  for (std::size_t i = 0; i < keyframe.u.size(); ++i) {
    const double inverse_depth = keyframe.inverse_depth[i];
    if (!(inverse_depth > 0.0) || !(keyframe.sigma[i] <= kLargestSigma * inverse_depth)) continue;
    const double depth = 1.0 / inverse_depth;
    const Vec3 point =
        keyframe.T_odom_left * Vec3(depth * (keyframe.u[i] - camera.cx) / camera.fx,
                                    depth * (keyframe.v[i] - camera.cy) / camera.fy, depth);
    if (point.allFinite() && point.norm() < kFarthest) out->push_back(point);
  }
}

/// One point of each cube of side `cell` [m].
std::vector<Vec3> thinned(const std::vector<Vec3>& points, double cell) {
  std::set<std::tuple<std::int64_t, std::int64_t, std::int64_t>> taken;
  std::vector<Vec3> out;
  for (const Vec3& point : points) {
    const Vec3 cube = (point / cell).array().floor();
    const auto key =
        std::make_tuple(static_cast<std::int64_t>(cube.x()), static_cast<std::int64_t>(cube.y()),
                        static_cast<std::int64_t>(cube.z()));
    if (taken.insert(key).second) out.push_back(point);
  }
  return out;
}

}  // namespace

std::vector<Vec3> map_points(const Dive& dive, const StereoOdometryConfig& config,
                             std::size_t most) {
  std::vector<Vec3> points;
  if (!dive.cameras || config.downscale < 1) return points;
  const CameraModel camera =
      optimal_pinhole(dive.cameras->rig.left.downscaled(config.downscale), config.undistortion);
  for (const DiveKeyframe& keyframe : dive.keyframes) {
    if (keyframe.metric) add_points(keyframe, camera, &points);
  }
  for (double cell = 0.01; points.size() > most; cell *= 1.4) points = thinned(points, cell);
  return points;
}

}  // namespace sovo::app
