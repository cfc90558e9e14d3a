#pragma once

#include <vector>

#include "sovo/driver/sim/ray_batch.h"
#include "sovo/driver/sim/scene_view.h"
#include "sovo/driver/sim/sim_config.h"
#include "sovo/geometry/stereo_rig.h"

namespace sovo::sim {

/// One of the vehicle's lamps as a camera has it: in the camera's frame.
struct Lamp {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();  ///< [m]
  Eigen::Vector3f axis = Eigen::Vector3f::UnitZ();     ///< Of the beam.
};

/// The vehicle's own lamps, which move with the cameras.
struct Lamps {
  std::vector<Lamp> lamps;
  float power = 0.0F;        ///< Light of each on a surface that faces it, 1 m away.
  float sharpness = 0.0F;    ///< Of the beam: light falls as exp(-sharpness * (1 - cos)).
  float haze = 0.0F;         ///< Share of the light that is lost is 1 - exp(-haze * way).
  float backscatter = 0.0F;  ///< Light that a metre of haze sends back, of that which it takes.

  bool lit() const { return !lamps.empty(); }

  /// Light of all lamps on a surface at `point` with normal `n` (unit); `two_sided`: whichever side
  /// is lit.
  float on_surface(const Eigen::Vector3f& point, const Eigen::Vector3f& n, bool two_sided) const;
  /// Light of all lamps that passes `point`.
  float at(const Eigen::Vector3f& point) const;

  /// Adds the light of the lamps on a surface, times what it reflects.
  void add_reflected(const SurfaceView& view, const RayBatch& rays, int end,
                     const BatchFloats& reflectance, BatchFloats* light) const;
  /// Adds the light that haze before the surfaces sends back.
  void add_backscatter(const RayBatch& rays, int end, BatchFloats* light) const;
};

/// Lamps of a rig as `side` has them. `haze`: of the world.
Lamps place_lamps(const LampConfig& config, const StereoRig& rig, Side side, double haze);

/// Share of the world's own light that is there at a time after the first pair [s]: as one dives at
/// an even pace it falls, and returns, by equal factors in equal times.
float share_of_daylight(const LampConfig& config, double since_s);

}  // namespace sovo::sim
