#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "sovo/app/app_config.h"
#include "sovo/io/result.h"

namespace sovo::app {

/// One way through a simulated world.
struct SyntheticCase {
  sim::World world = sim::World::kLawn;
  std::string trajectory;  ///< One of the world's own.
  bool reverse = false;    ///< Flown backwards.
};

/// Every trajectory of every world, forward and backward.
std::vector<SyntheticCase> all_synthetic_cases();

/// "street/town", with " <" when it is flown backwards.
std::string name_of(const SyntheticCase& which);

/// How right and how fast one run was. Relative errors are of the refined trajectory, as
/// `sovo eval` has them.
struct SyntheticResult {
  double length_m = 0.0;      ///< Of the true path.
  std::size_t frames = 0;     ///< Fed.
  double completion = 0.0;    ///< Frames with a valid pose / frames fed [1].
  double t_rel = 0.0;         ///< Mean over the pieces [1].
  double r_rel = 0.0;         ///< [rad/m]
  double ate_m = 0.0;         ///< RMSE after the best SE(3).
  double scale_median = 0.0;  ///< |ln s| of the depths in each keyframe, after its correction [1].
  double scale_p95 = 0.0;
  /// Mean of (ln s / sigma)^2 with the scale's posterior sigma at the keyframe: 1 when honest.
  double scale_nees = 0.0;
  /// The same per degree of freedom of the published poses, one as seen from another 1 s or 10 m
  /// before it.
  double pose_nees_1s = 0.0;
  double pose_nees_10m = 0.0;
  double frame_ms = 0.0;             ///< Mean, everything but rendering, one frame after the other.
  double keyframes_per_frame = 0.0;  ///< [1]
};

/// Runs the odometry of `config`, deterministic, through a rendered world and compares it with the
/// truth. `seed` is that of the world, the noise and the odometry. `progress` is called after each
/// frame with how many are done and how many there are; false stops the run, which is an error.
Result<SyntheticResult> run_synthetic(
    const AppConfig& config, const SyntheticCase& which, std::uint64_t seed,
    const std::function<bool(std::size_t, std::size_t)>& progress);

}  // namespace sovo::app
