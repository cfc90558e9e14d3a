#include "sovo/driver/sim/scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "sovo/driver/sim/random.h"

namespace sovo::sim {
namespace {

Vec3 heading(double yaw) { return {std::cos(yaw), std::sin(yaw), 0.0}; }

}  // namespace

Layer layer(int texture, double scale, Blend blend, float amplitude, double angle) {
  Layer l;
  l.texture = texture;
  l.blend = blend;
  l.amplitude = amplitude;
  const double c = std::cos(angle) / scale;
  const double s = std::sin(angle) / scale;
  l.map = {c, s, -s, c};
  return l;
}

Layer stretched(int texture, double scale_x, double scale_y, Blend blend, float amplitude) {
  Layer l = layer(texture, 1.0, blend, amplitude);
  l.map = {1.0 / scale_x, 0.0, 0.0, 1.0 / scale_y};
  return l;
}

Layer on_world(Layer layer) {
  layer.world = true;
  return layer;
}

int SceneBuilder::texture(const ImageF& pattern) {
  scene_.textures.emplace_back(pattern);
  return static_cast<int>(scene_.textures.size()) - 1;
}

int SceneBuilder::material(Material material) {
  for (Layer& l : material.layers) {
    const double area = std::abs(l.map[0] * l.map[3] - l.map[1] * l.map[2]);
    const int size = scene_.textures[static_cast<std::size_t>(l.texture)].size();
    l.log_texels = static_cast<float>(std::log2(size * std::sqrt(area)));
  }
  scene_.materials.push_back(std::move(material));
  return static_cast<int>(scene_.materials.size()) - 1;
}

int SceneBuilder::material(float base, std::vector<Layer> layers) {
  Material m;
  m.base = base;
  m.layers = std::move(layers);
  return material(std::move(m));
}

int SceneBuilder::cutout(const Cutout& cutout, double width, double height) {
  Material m;
  m.base = 0.0F;
  m.layers = {stretched(texture(cutout.value), width, height, Blend::kMax, 1.0F)};
  m.opacity = texture(cutout.opacity);
  return material(std::move(m));
}

float SceneBuilder::light(const Vec3& normal) const {
  const double sun = std::max(0.0, normal.dot(scene_.to_sun));
  const double sky = 0.75 + 0.25 * normal.z();
  return static_cast<float>(scene_.ambient * sky + scene_.sun * sun);
}

double SceneBuilder::decal_height() {
  // Seven heights in turn keep neighbours from lying in one plane.
  decals_ = (decals_ + 1) % 7;
  return 0.002 + 0.0015 * decals_;
}

Surface& SceneBuilder::quad(const Vec3& centre, const Vec3& u, const Vec3& v, double width,
                            double height, int material) {
  Surface s;
  s.centre = centre;
  s.u = u;
  s.v = v;
  s.n = u.cross(v);
  s.half_u = 0.5 * width;
  s.half_v = 0.5 * height;
  s.material = material;
  s.light = light(s.n);
  scene_.surfaces.push_back(s);
  return scene_.surfaces.back();
}

Surface& SceneBuilder::floor(const Vec3& centre, double yaw, double length, double width,
                             int material) {
  return quad(centre, heading(yaw), heading(yaw + 0.5 * std::numbers::pi), length, width, material);
}

Surface& SceneBuilder::wall(const Vec3& foot, double yaw, double width, double height,
                            int material) {
  // Seen from the front, u goes right and v goes down, as patterns do.
  const Vec3 down = -Vec3::UnitZ();
  const Vec3 u = down.cross(heading(yaw));
  Surface& s = quad(foot - 0.5 * height * down, u, down, width, height, material);
  s.foot_shade = 0.35F;
  return s;
}

std::size_t SceneBuilder::box(const Vec3& foot, double yaw, const Vec3& size, int sides, int top) {
  const std::size_t first = scene_.surfaces.size();
  for (int i = 0; i < 4; ++i) {
    const double side = yaw + 0.5 * std::numbers::pi * i;
    const double depth = i % 2 == 0 ? size.x() : size.y();
    const double width = i % 2 == 0 ? size.y() : size.x();
    wall(foot + 0.5 * depth * heading(side), side, width, size.z(), sides);
  }
  floor(foot + size.z() * Vec3::UnitZ(), yaw, size.x(), size.y(), top);
  return first;
}

Surface& SceneBuilder::cylinder(const Vec3& centre, const Vec3& axis, double radius, double length,
                                int material) {
  const Vec3 helper = std::abs(axis.z()) < 0.9 ? Vec3::UnitZ() : Vec3::UnitX();
  const Vec3 u = helper.cross(axis).normalized();
  Surface& s = quad(centre, u, axis, 2.0 * radius, length, material);
  s.shape = Shape::kCylinder;
  s.half_u = radius;
  return s;
}

Surface& SceneBuilder::shadow(const Vec3& centre, double yaw, double length, double width,
                              int material) {
  Surface& s = floor(centre + decal_height() * Vec3::UnitZ(), yaw, length, width, material);
  s.decal = true;
  return s;
}

void SceneBuilder::tree(const Tree& tree) {
  Random random(tree.seed);
  const double trunk = tree.height - 1.2 * tree.crown;
  cylinder(tree.foot + 0.5 * (trunk + 0.6 * tree.crown) * Vec3::UnitZ(), Vec3::UnitZ(),
           0.06 * tree.crown + 0.04, trunk + 0.6 * tree.crown, tree.trunk);
  const Vec3 middle = tree.foot + (tree.height - tree.crown) * Vec3::UnitZ();
  for (int i = 0; i < tree.bunches; ++i) {
    const double z = random.uniform(-1.0, 1.0);
    const double around = random.uniform(0.0, 2.0 * std::numbers::pi);
    const double r = tree.crown * std::cbrt(random.uniform(0.1, 1.0)) * 0.75;
    const double flat = std::sqrt(1.0 - z * z);
    const Vec3 out(flat * std::cos(around), flat * std::sin(around), z);
    // Each bunch looks outwards, more or less.
    const Vec3 n = (out + Vec3(random.uniform(-0.7, 0.7), random.uniform(-0.7, 0.7),
                               random.uniform(-0.4, 0.4)))
                       .normalized();
    const Vec3 u =
        (std::abs(n.z()) < 0.95 ? Vec3(Vec3::UnitZ()) : Vec3(Vec3::UnitX())).cross(n).normalized();
    const double size = tree.crown * random.uniform(0.9, 1.3);
    const int leaves =
        tree.leaves[static_cast<std::size_t>(random.below(static_cast<int>(tree.leaves.size())))];
    Surface& s = quad(middle + r * out, u, n.cross(u), size, size, leaves);
    s.two_sided = true;
    const double lit = 0.45 + 0.35 * (0.5 + 0.5 * z) + 0.35 * std::max(0.0, out.dot(scene_.to_sun));
    s.light = static_cast<float>(lit * random.uniform(0.8, 1.15));
  }
  if (tree.shadow < 0) return;
  const Vec3 away = -scene_.to_sun / scene_.to_sun.z();
  Vec3 where = tree.foot + (tree.height - tree.crown) * away;
  where.z() = tree.foot.z();
  const double yaw = std::atan2(away.y(), away.x());
  const double length = 2.3 * tree.crown * std::hypot(1.0, std::hypot(away.x(), away.y()));
  shadow(where, yaw, length, 2.3 * tree.crown, tree.shadow);
}

}  // namespace sovo::sim
