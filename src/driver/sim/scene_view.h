#pragma once

#include <limits>
#include <vector>

#include "sovo/driver/sim/ray_table.h"
#include "sovo/driver/sim/scene.h"
#include "sovo/geometry/se3.h"

namespace sovo::sim {

/// Range of a ray that meets nothing.
inline constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// A surface as a camera has it before it: vectors are of the camera's frame, lengths in metres.
struct SurfaceView {
  Shape shape = Shape::kQuad;
  int surface = 0;  ///< Index in the scene.
  bool two_sided = false;
  bool unbounded = false;
  float n[3], u[3], v[3];
  float centre[3];
  float side[3];        ///< Cylinder: centre x axis.
  float height = 0.0F;  ///< Of the camera above the plane, along n.
  float along = 0.0F;   ///< Cylinder: axis . centre.
  double foot_u = 0.0;  ///< The camera's own coordinates on the surface.
  double foot_v = 0.0;
  float half_u = 0.0F, half_v = 0.0F;
  float nearest = 0.0F;   ///< No point of it is nearer than this.
  float distance = 0.0F;  ///< Of its centre.
  float radius = 0.0F;    ///< Of the ball around its centre that holds it.
};

/// Range at which the ray `d` (unit, or nearly) meets the surface, or infinity.
float range_along(const SurfaceView& view, const Eigen::Vector3f& d);

/// Components of unit rays, in the camera's frame.
struct Rays {
  const float* dx;
  const float* dy;
  const float* dz;
  int count;
};

/// Lowers `range`, and sets `surface` to `index`, at all rays that meet the surface before that.
void cover_rays(const SurfaceView& view, int index, const Rays& rays, float* range, int* surface);

/// What of a scene a camera may see from where it is, nearest first.
class SceneView {
 public:
  explicit SceneView(const Scene& scene) : scene_(&scene) {}

  /// Moves the camera, and what moves on its own, to time `t` of the world [s].
  void update(const SE3& T_world_camera, double t);

  /// All that may be seen; the lists below hold indices into it.
  const std::vector<SurfaceView>& views() const { return views_; }
  /// Surfaces without holes by their nearest point, and those with holes by their centres.
  const std::vector<int>& solid() const { return solid_; }
  const std::vector<int>& pierced() const { return pierced_; }

  /// Those of `from` that rays of the cone may meet, in the same order.
  void select(const RayCone& cone, const std::vector<int>& from, std::vector<int>* to) const;

 private:
  /// Adds surfaces [first, last), given in a frame of their own, that may be seen.
  void add(std::size_t first, std::size_t last, const SE3& T_frame_camera);

  const Scene* scene_;
  std::vector<SurfaceView> views_;
  std::vector<int> solid_;
  std::vector<int> pierced_;
};

}  // namespace sovo::sim
