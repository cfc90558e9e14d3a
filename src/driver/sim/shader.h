#pragma once

#include <utility>

#include "sovo/driver/sim/lamps.h"
#include "sovo/driver/sim/own_shadow.h"
#include "sovo/driver/sim/pattern_lookup.h"
#include "sovo/driver/sim/ray_batch.h"
#include "sovo/driver/sim/scene_view.h"

namespace sovo::sim {

/// Light that leaves surfaces towards a camera; patterns are looked up at the resolution at which
/// a pixel sees them. Batches must not be empty; the shader pads them.
class Shader {
 public:
  Shader(const Scene& scene, Lamps lamps, OwnShadow shadow)
      : scene_(&scene), lamps_(std::move(lamps)), shadow_(std::move(shadow)) {}

  /// Moves the camera, and the water, to time `t` [s].
  void update(const SE3& T_world_camera, double t);

  /// Share of the world's own light that is there from now on.
  void set_daylight(float share) { daylight_ = share; }

  /// Light from where rays meet a surface.
  void light(const SurfaceView& view, RayBatch* rays, BatchFloats* light) const;

  /// How much of a surface with holes is covered where rays meet it, 0 to 1.
  void cover(const SurfaceView& view, RayBatch* rays, BatchFloats* opacity) const;

  /// Light from beyond all surfaces; the rays' range is not used.
  void sky(RayBatch* rays, BatchFloats* light) const;

 private:
  void reflect(const Material& material, const Spots& spots, BatchFloats* light) const;
  void add_caustics(const Spots& spots, BatchFloats* light) const;
  void add_own_shadow(const RayBatch& rays, float sun_and_sky, const Spots* round, int end,
                      BatchFloats* light) const;
  float sky_of(const Eigen::Vector3f& ray, float pixel_angle) const;
  float hills(double azimuth, double elevation, float pixel_angle, float beyond) const;

  const Scene* scene_;
  Lamps lamps_;
  float daylight_ = 1.0F;  ///< Share of the world's own light.
  OwnShadow shadow_;
  SE3 T_world_camera_;
  Mat3 R_world_camera_ = Mat3::Identity();
  Eigen::Vector3f to_sun_ = Eigen::Vector3f::Zero();  ///< In the camera's frame.
  double time_ = 0.0;
};

}  // namespace sovo::sim
