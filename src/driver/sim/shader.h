#pragma once

#include "sovo/driver/sim/scene_view.h"

namespace sovo::sim {

/// Light that leaves surfaces towards a camera; patterns are looked up at the resolution at which
/// a pixel sees them.
class Shader {
 public:
  explicit Shader(const Scene& scene) : scene_(&scene) {}

  /// Moves the camera, and the water, to time `t` [s].
  void update(const SE3& T_world_camera, double t);

  /// Light from where `ray` meets the surface at `range`, and how much of it is covered there.
  struct Sample {
    float value = 0.0F;
    float opacity = 1.0F;
  };
  Sample surface(const SurfaceView& view, const Eigen::Vector3f& ray, float range,
                 float pixel_angle) const;

  /// Light from beyond all surfaces.
  float sky(const Eigen::Vector3f& ray, float pixel_angle) const;

 private:
  struct Spot;
  Spot spot(const SurfaceView& view, const Eigen::Vector3f& ray, float range,
            float pixel_angle) const;
  float pattern(const Layer& l, const Spot& p) const;
  float reflected(const Material& material, const Spot& spot) const;
  float caustics(const Spot& p) const;
  float hills(double azimuth, double elevation, float pixel_angle, float beyond) const;

  const Scene* scene_;
  SE3 T_world_camera_;
  Mat3 R_world_camera_ = Mat3::Identity();
  Eigen::Vector3f to_sun_ = Eigen::Vector3f::Zero();  ///< In the camera's frame.
  double time_ = 0.0;
};

}  // namespace sovo::sim
