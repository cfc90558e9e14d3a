#include <algorithm>
#include <cmath>
#include <numbers>

#include "sovo/driver/sim/noise.h"
#include "sovo/driver/sim/random.h"
#include "sovo/driver/sim/surroundings.h"
#include "sovo/driver/sim/world.h"

namespace sovo::sim {
namespace {

constexpr double kTile = 0.15;  ///< Side of a tile [m].

struct PoolMaterials {
  int floor, wall, line, water, metal, toy;
};

PoolMaterials pool_materials(SceneBuilder& b, std::uint64_t seed) {
  PoolMaterials m;
  const int tiles = b.texture(tile_pattern(1024, 16, seed));
  const int stains = b.texture(noise_pattern(512, 4, 8, 0.75F, seed + 1));
  const auto tiled = [&](float base, float contrast) {
    Material material;
    material.base = base;
    material.layers = {layer(tiles, 16.0 * kTile, Blend::kAdd, contrast),
                       layer(stains, 5.3, Blend::kMultiply, 0.9F, 0.6),
                       layer(stains, 1.37, Blend::kMultiply, 0.5F, 2.0)};
    return b.material(material);
  };
  m.floor = tiled(0.56F, 0.95F);
  m.wall = tiled(0.5F, 0.7F);
  m.line = tiled(0.12F, 0.22F);
  Material water;
  water.base = 0.8F;
  Layer ripples = layer(stains, 2.7, Blend::kAdd, 0.9F);
  ripples.velocity = {0.05, 0.03};
  water.layers = {ripples};
  m.water = b.material(water);
  Material metal;
  metal.base = 0.6F;
  metal.layers = {layer(stains, 0.4, Blend::kAdd, 0.8F)};
  m.metal = b.material(metal);
  Material toy;
  toy.base = 0.0F;
  toy.layers = {layer(b.texture(machine_pattern(256, seed + 2)), 0.5, Blend::kMax, 1.1F)};
  m.toy = b.material(toy);
  return m;
}

/// The basin: where its floor ends and how deep the water is.
struct Basin {
  double x0, x1, y0, y1, depth;
};

void add_basin(SceneBuilder& b, const PoolMaterials& m, const Basin& p) {
  const double length = p.x1 - p.x0;
  const double width = p.y1 - p.y0;
  const Vec3 middle(0.5 * (p.x0 + p.x1), 0.5 * (p.y0 + p.y1), 0.0);
  b.floor(middle, 0.0, length, width, m.floor);
  b.wall({p.x0, middle.y(), 0.0}, 0.0, width, p.depth, m.wall);
  b.wall({p.x1, middle.y(), 0.0}, std::numbers::pi, width, p.depth, m.wall);
  b.wall({middle.x(), p.y0, 0.0}, 0.5 * std::numbers::pi, length, p.depth, m.wall);
  b.wall({middle.x(), p.y1, 0.0}, -0.5 * std::numbers::pi, length, p.depth, m.wall);
  // The water's surface from below; it is bright, whatever the sun's side.
  Surface& water = b.quad(middle + p.depth * Vec3::UnitZ(), Vec3::UnitY(), Vec3::UnitX(), width,
                          length, m.water);
  water.light = 1.0F;
  const double line = 2.0 * kTile;
  for (double y = p.y0 + 1.35; y < p.y1 - 0.5; y += 3.6) {
    b.floor({middle.x(), y, 0.003}, 0.0, length - 4.0, line, m.line);
    for (const double x : {p.x0 + 2.0, p.x1 - 2.0}) {
      b.floor({x, y, 0.005}, 0.0, line, 6.0 * kTile, m.line);
    }
    for (const double yaw : {0.0, std::numbers::pi}) {  // targets on the walls
      const double x = yaw == 0.0 ? p.x0 + 0.004 : p.x1 - 0.004;
      b.wall({x, y, 0.4}, yaw, line, p.depth - 0.8, m.line);
      b.wall({x, y, 0.9}, yaw, 6.0 * kTile, line, m.line).centre.x() += yaw == 0.0 ? 0.003 : -0.003;
    }
  }
}

void add_things(SceneBuilder& b, const PoolMaterials& m, const Basin& p, const Footprint& way,
                Random& random) {
  const int drains = static_cast<int>((p.x1 - p.x0) / 4.0);
  for (int i = 0; i < drains; ++i) {
    b.floor({p.x0 + 2.0 + 4.0 * i, p.y0 + 0.6, 0.006}, 0.0, 0.45, 0.3, m.toy);
  }
  for (int i = 0; i < 26; ++i) {  // bricks and rings to dive for
    const double x = random.uniform(p.x0 + 1.0, p.x1 - 1.0);
    const double y = random.uniform(p.y0 + 1.0, p.y1 - 1.0);
    const double size = random.uniform(0.12, 0.35);
    if (way.near_point({x, y, size}, 0.6)) continue;
    if (random.chance(0.7)) {
      b.box({x, y, 0.0}, random.uniform(0.0, std::numbers::pi), {size, 0.6 * size, 0.5 * size},
            m.toy, m.toy);
    } else {
      b.cylinder({x, y, 0.04}, Vec3(std::cos(4.0 * x), std::sin(4.0 * x), 0.0), 0.04, 2.0 * size,
                 m.metal);
    }
  }
  for (const double x : {p.x0 + 3.0, p.x1 - 3.0}) {  // ladders
    for (const double y : {p.y0 + 0.15, p.y1 - 0.15}) {
      for (const double side : {-0.25, 0.25}) {
        b.cylinder({x + side, y, 0.5 * p.depth + 0.3}, Vec3::UnitZ(), 0.025, p.depth - 0.6,
                   m.metal);
      }
      for (double z = 0.7; z < p.depth; z += 0.3) {
        b.cylinder({x, y, z}, Vec3::UnitX(), 0.025, 0.5, m.metal);
      }
    }
  }
}

}  // namespace

Scene build_pool(const Motion& motion, std::uint64_t seed) {
  SceneBuilder b;
  Scene& scene = b.scene();
  scene.to_sun = Vec3(0.2, -0.15, 0.97).normalized();
  scene.ambient = 0.45F;
  scene.sun = 0.35F;
  scene.exposure_s = 0.006;
  const PoolMaterials m = pool_materials(b, combine(seed, 21));
  scene.caustics = b.texture(caustic_pattern(512, 100, combine(seed, 22)));
  scene.caustic_strength = 0.12F;
  scene.haze = 0.14;
  scene.haze_colour = 0.34F;
  scene.sky = {0.34F, 0.34F, -1, -1, 0.0F};
  scene.particles = {420, 4.0, 0.0022, 0.9F, {0.02, 0.01, -0.008}, combine(seed, 23)};
  const Footprint way(motion);
  const double margin = 4.5;
  const Basin basin{way.low().x() - margin, way.high().x() + margin, way.low().y() - 3.15,
                    way.high().y() + 3.15, std::max(2.0, way.high().z() + 0.6)};
  Random random(combine(seed, 24));
  add_basin(b, m, basin);
  add_things(b, m, basin, way, random);
  return b.take();
}

}  // namespace sovo::sim
