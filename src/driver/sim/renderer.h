#pragma once

#include <array>
#include <functional>
#include <vector>

#include "sovo/driver/sim/lamps.h"
#include "sovo/driver/sim/ray_table.h"
#include "sovo/driver/sim/scene_view.h"
#include "sovo/driver/sim/shader.h"
#include "sovo/driver/sim/tile_samples.h"
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
  /// The scene must outlive the renderer. `lamps` and `shadow`: of the vehicle,
  /// in the camera's frame.
  Renderer(const Scene& scene, const CameraModel& camera, const Lamps& lamps = {},
           const OwnShadow& shadow = {});

  /// Share of the world's own light that is there from now on.
  void set_daylight(float share);

  /// The picture from a pose at time `t` of the world [s].
  void render(const SE3& T_world_camera, double t, RenderedImage* image);

  /// When and from where a row of the image is taken.
  struct View {
    SE3 T_world_camera;
    double t = 0.0;  ///< Of the world [s].
  };
  /// The picture of a rolling shutter: a few rows at a time are of one instant, as `view_of` tells
  /// for a place on the image's vertical axis [px].
  void render_rolling(const std::function<View(double row)>& view_of, RenderedImage* image);

  /// Distance along the ray of any place of the image at the pose rendered last, to surfaces
  /// without holes [m]; infinite for the sky.
  float range_at(const Vec2& pixel) const;

  const RayTable& rays() const { return rays_; }

 private:
  static constexpr int kSide = RayTable::kTile + 2;  ///< A tile with the pixels around it.
  using Neighbourhood = std::array<int, static_cast<std::size_t>(kSide) * kSide>;

  /// Rows of the image that are of one instant: [begin, end).
  struct Band {
    int begin = 0;
    int end = 0;
  };
  void render_band(const View& view, const Band& band, RenderedImage* image);
  void find_surfaces(const Band& band);
  void find_in_tile_rows(int first, int last);
  void find_in_block_row(int by, int first_tile_row, int last_tile_row);
  void find_in_tile(int tile);
  void shade_tile(int tile, const Band& band, RenderedImage* image);
  void look_around(int x0, int y0, Neighbourhood* around) const;
  void add_edge(int x, int y, const int* around);
  void draw_particles(const View& view, const Band& band, RenderedImage* image) const;

  const Scene* scene_;
  Lamps lamps_;
  float daylight_ = 1.0F;  ///< Share of the world's own light.
  RayTable rays_;
  SceneView view_;
  Shader shader_;
  TileSamples samples_;
  AlignedVector<float> range_;                ///< In the order of the ray table.
  AlignedVector<int> surface_;                ///< Index of a view.
  std::vector<std::vector<int>> tile_solid_;  ///< What each tile may see.
  std::vector<std::vector<int>> tile_pierced_;
  std::vector<int> block_solid_;  ///< What the block at work may see.
  std::vector<int> block_pierced_;
};

}  // namespace sovo::sim
