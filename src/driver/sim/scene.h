#pragma once

#include <Eigen/Geometry>
#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "sovo/driver/sim/patterns.h"
#include "sovo/driver/sim/texture.h"
#include "sovo/geometry/se3.h"

namespace sovo::sim {

/// How a layer joins what lies below it.
enum class Blend {
  kAdd,       ///< v + amplitude * (s - mean)
  kMultiply,  ///< v * (1 + amplitude * (s - mean))
  kMax,       ///< max(v, amplitude * s)
  kDarken,    ///< v * (1 - amplitude * s): lines and stains
};

/// One pattern on a surface.
struct Layer {
  int texture = 0;
  Blend blend = Blend::kAdd;
  float amplitude = 1.0F;
  /// Tiles of the pattern per metre of the surface: (u, v) = map * (x, y) + velocity * t.
  std::array<double, 4> map{1.0, 0.0, 0.0, 1.0};
  std::array<double, 2> velocity{0.0, 0.0};  ///< [tiles/s]
  bool world = false;                        ///< (x, y) are the world's, not the surface's own.
  float log_texels = 0.0F;                   ///< log2 of texels per metre; set with the material.
};

struct Material {
  float base = 0.5F;  ///< Reflected light before the layers.
  std::vector<Layer> layers;
  int opacity = -1;  ///< Texture of what is covered, stretched over the surface; -1: all of it is.
};

/// What a surface is.
enum class Shape {
  kQuad,      ///< Rectangle |x| <= half_u along u, |y| <= half_v along v.
  kCylinder,  ///< Side of a cylinder about v: radius half_u, |y| <= half_v.
};

struct Surface {
  Shape shape = Shape::kQuad;
  Vec3 centre = Vec3::Zero();  ///< [m]
  Vec3 u = Vec3::UnitX();
  Vec3 v = Vec3::UnitY();
  Vec3 n = Vec3::UnitZ();  ///< u x v; the side that is seen.
  double half_u = 1.0;     ///< [m]
  double half_v = 1.0;     ///< [m]
  bool two_sided = false;
  bool decal = false;  ///< Lies on another surface: its depth is that surface's.
  bool unbounded = false;
  int material = 0;
  float light = 1.0F;       ///< Light that falls on it.
  float tint = 1.0F;        ///< Factor on what it reflects.
  double texture_x = 0.0;   ///< Added to the surface's own coordinates [m].
  double texture_y = 0.0;   ///< [m]
  float foot_shade = 0.0F;  ///< Darkening at its lower end (world z = 0), 0 to 1.
};

/// Surfaces that move together: they are given in a frame of their own.
struct Mover {
  std::size_t first = 0;  ///< Of its surfaces.
  std::size_t last = 0;   ///< One beyond them.
  /// T_world_mover at a time of the world [s]; nothing while it is not there.
  std::function<std::optional<SE3>(double t)> place;
};

/// Something small and soft that drifts in the water.
struct Particles {
  int count = 0;
  double box = 4.0;       ///< Side of the cube around the camera that they fill [m].
  double radius = 0.004;  ///< [m]
  float brightness = 1.0F;
  Vec3 drift = Vec3::Zero();  ///< [m/s]
  std::uint64_t seed = 0;
};

/// What is seen where nothing else is.
struct Sky {
  float zenith = 0.5F;
  float horizon = 0.8F;
  int clouds = -1;            ///< Texture, or -1 for none.
  int hills = -1;             ///< Texture of the far background, or -1 for none.
  float hill_height = 0.12F;  ///< Of the highest hills [rad].
};

/// A world: surfaces in a frame with z up, the ground near z = 0.
struct Scene {
  std::vector<Texture> textures;
  std::vector<Material> materials;
  std::vector<Surface> surfaces;
  std::vector<Mover> movers;  ///< Of the last surfaces, in their order.
  Particles particles;
  Sky sky;
  Vec3 to_sun = Vec3(0.4, 0.3, 0.86).normalized();
  float ambient = 0.4F;
  float sun = 0.8F;
  /// Share of light that is left after a metre of air or water is exp(-haze).
  double haze = 0.0;
  float haze_colour = 0.6F;
  int caustics = -1;  ///< Texture of moving light on surfaces that look up, or -1 for none.
  float caustic_strength = 0.0F;
  double exposure_s = 0.005;  ///< That shows a value of 1 as full scale at no gain.
};

/// Puts a scene together.
class SceneBuilder {
 public:
  int texture(const ImageF& pattern);
  int material(Material material);
  /// Opaque, of layers upon a base.
  int material(float base, std::vector<Layer> layers);
  /// Material from a cutout, stretched over the surface it is used on.
  int cutout(const Cutout& cutout, double width, double height);

  /// Rectangle with its own light from the sun and the sky. `u`, `v`: unit vectors, the seen side
  /// is u x v.
  Surface& quad(const Vec3& centre, const Vec3& u, const Vec3& v, double width, double height,
                int material);
  /// Horizontal rectangle seen from above, turned by `yaw`.
  Surface& floor(const Vec3& centre, double yaw, double length, double width, int material);
  /// Upright wall whose seen side looks along `yaw`; `foot`: middle of its lower edge.
  Surface& wall(const Vec3& foot, double yaw, double width, double height, int material);
  /// The five seen sides of a box that stands on `foot`. Returns the index of the first.
  std::size_t box(const Vec3& foot, double yaw, const Vec3& size, int sides, int top);
  Surface& cylinder(const Vec3& centre, const Vec3& axis, double radius, double length,
                    int material);
  /// A tree: trunk and bunches of leaves (`leaves`: materials of cutouts), and its shadow.
  struct Tree {
    Vec3 foot = Vec3::Zero();
    double height = 6.0;
    double crown = 2.0;  ///< Radius of the crown [m].
    int bunches = 16;
    int trunk = 0;
    std::vector<int> leaves;
    int shadow = -1;  ///< Material of a cutout, or -1 for none.
    std::uint64_t seed = 0;
  };
  void tree(const Tree& tree);
  /// A dark spot on the ground.
  Surface& shadow(const Vec3& centre, double yaw, double length, double width, int material);

  Scene& scene() { return scene_; }
  Scene take() { return std::move(scene_); }

 private:
  float light(const Vec3& normal) const;
  double decal_height();

  Scene scene_;
  int decals_ = 0;
};

/// A layer at `scale` metres a tile, turned by `angle` [rad].
Layer layer(int texture, double scale, Blend blend, float amplitude, double angle = 0.0);

/// The same with different scales along x and y.
Layer stretched(int texture, double scale_x, double scale_y, Blend blend, float amplitude);

/// The layer by the coordinates of the world, so that it goes on from surface to surface.
Layer on_world(Layer layer);

}  // namespace sovo::sim
