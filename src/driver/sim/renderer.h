#pragma once

#include <array>
#include <vector>

#include "sovo/driver/sim/ray_table.h"
#include "sovo/driver/sim/scene_view.h"
#include "sovo/driver/sim/shader.h"
#include "sovo/image/image.h"

namespace sovo::sim {

/// What a camera sees, before its sensor.
struct RenderedImage {
  ImageF light;  ///< 1 is white in the sun.
  /// Distance along the ray of each pixel's centre [m]; infinite for the sky. Where leaves cover a
  /// pixel by more than half, theirs.
  ImageF range;
};

/// Renders a scene through one camera of any model: rays are cast tile by tile at the surfaces
/// that the tile may see, pixels in which surfaces meet are cast again at eight places.
class Renderer {
 public:
  /// The scene must outlive the renderer.
  Renderer(const Scene& scene, const CameraModel& camera);

  /// The picture from a pose at time `t` of the world [s].
  void render(const SE3& T_world_camera, double t, RenderedImage* image);

  /// Distance along the ray of any place of the image at the pose rendered last, to surfaces
  /// without holes [m]; infinite for the sky.
  float range_at(const Vec2& pixel) const;

  const RayTable& rays() const { return rays_; }

 private:
  struct Composite {
    float value = 0.0F;
    float range = 0.0F;
  };
  /// A surface that some of a pixel's eight rays meet.
  struct Part {
    int surface = -1;
    int count = 0;
    Eigen::Vector3f ray = Eigen::Vector3f::Zero();  ///< Sum of those rays.
  };

  void find_surfaces();
  void shade_tile(int tile, RenderedImage* image);
  Composite composite(const Eigen::Vector3f& ray, int tile, int surface, float range,
                      float angle) const;
  bool on_edge(int x, int y) const;
  float shade_edge(int x, int y, int tile, float angle) const;
  void draw_particles(const SE3& T_world_camera, double t, RenderedImage* image) const;
  int surface_at(int x, int y) const { return surface_[rays_.index(x, y)]; }

  const Scene* scene_;
  RayTable rays_;
  SceneView view_;
  Shader shader_;
  AlignedVector<float> range_;  ///< In the order of the ray table.
  AlignedVector<int> surface_;
  std::vector<std::vector<int>> tile_solid_;  ///< What each tile may see.
  std::vector<std::vector<int>> tile_pierced_;
};

}  // namespace sovo::sim
