#include <algorithm>
#include <cmath>
#include <numbers>

#include "sovo/driver/sim/noise.h"
#include "sovo/driver/sim/random.h"
#include "sovo/driver/sim/surroundings.h"
#include "sovo/driver/sim/world.h"

namespace sovo::sim {
namespace {

struct HallMaterials {
  int concrete, wall, ceiling, pipe, yellow, shadow;
  std::vector<int> machines;
  std::vector<int> crates;
  std::vector<int> posters;
};

HallMaterials hall_materials(SceneBuilder& b, std::uint64_t seed) {
  HallMaterials m;
  const int concrete = b.texture(concrete_pattern(512, seed));
  const int noise = b.texture(noise_pattern(512, 4, 8, 0.75F, seed + 1));
  const int bricks = b.texture(brick_pattern(512, 32, seed + 2));
  const auto add = [&b](float base, std::vector<Layer> layers) {
    Material material;
    material.base = base;
    material.layers = std::move(layers);
    return b.material(std::move(material));
  };
  m.concrete = add(0.45F, {layer(concrete, 3.1, Blend::kAdd, 0.7F, 0.3),
                           layer(concrete, 1.27, Blend::kAdd, 0.4F, 1.4),
                           layer(noise, 9.1, Blend::kMultiply, 0.9F, 0.8)});
  m.wall = add(
      0.42F, {layer(bricks, 2.4, Blend::kAdd, 0.8F), layer(noise, 7.3, Blend::kMultiply, 1.1F, 0.5),
              layer(noise, 1.9, Blend::kMultiply, 0.5F, 1.2)});
  m.ceiling = add(
      0.3F, {layer(concrete, 2.9, Blend::kAdd, 0.6F), layer(noise, 6.7, Blend::kMultiply, 1.0F)});
  m.pipe = add(
      0.5F, {layer(noise, 0.9, Blend::kAdd, 0.9F), layer(concrete, 2.3, Blend::kMultiply, 0.6F)});
  m.yellow = add(0.75F, {layer(concrete, 1.7, Blend::kMultiply, 1.0F)});
  m.shadow = b.cutout(spot_cutout(128, 0.7, 0.3, seed + 3), 1.0, 1.0);
  for (unsigned i = 0; i < 4; ++i) {
    const int machine = b.texture(machine_pattern(512, seed + 10 + i));
    m.machines.push_back(add(0.0F, {layer(machine, 1.9 + 0.3 * i, Blend::kMax, 1.0F),
                                    layer(noise, 3.7, Blend::kMultiply, 0.8F, 0.4)}));
    const int crate = b.texture(crate_pattern(512, seed + 20 + i));
    m.crates.push_back(add(0.0F, {layer(crate, 1.0, Blend::kMax, 1.0F),
                                  layer(noise, 2.9, Blend::kMultiply, 0.9F, 0.9)}));
    const int poster = b.texture(facade_pattern(256, static_cast<int>(i), seed + 30 + i));
    m.posters.push_back(add(0.0F, {layer(poster, 1.3, Blend::kMax, 1.1F)}));
  }
  return m;
}

struct Room {
  double x0, x1, y0, y1, height;
};

/// Lamps overhead, not a sun: walls get light by their direction only a little.
void light_evenly(SceneBuilder& b, std::size_t first, Random& random) {
  auto& surfaces = b.scene().surfaces;
  for (std::size_t i = first; i < surfaces.size(); ++i) {
    Surface& s = surfaces[i];
    s.light = static_cast<float>(0.62 + 0.12 * s.n.x() + 0.07 * s.n.y() + 0.25 * s.n.z());
    s.texture_x = random.uniform(0.0, 50.0);
    s.texture_y = s.shape == Shape::kCylinder ? random.uniform(0.0, 50.0) : 0.0;
  }
}

void add_shell(SceneBuilder& b, const HallMaterials& m, const Room& r) {
  const Vec3 middle(0.5 * (r.x0 + r.x1), 0.5 * (r.y0 + r.y1), 0.0);
  const double length = r.x1 - r.x0;
  const double width = r.y1 - r.y0;
  b.floor(middle, 0.0, length, width, m.concrete);
  b.quad(middle + r.height * Vec3::UnitZ(), Vec3::UnitY(), Vec3::UnitX(), width, length, m.ceiling);
  b.wall({r.x0, middle.y(), 0.0}, 0.0, width, r.height, m.wall);
  b.wall({r.x1, middle.y(), 0.0}, std::numbers::pi, width, r.height, m.wall);
  b.wall({middle.x(), r.y0, 0.0}, 0.5 * std::numbers::pi, length, r.height, m.wall);
  b.wall({middle.x(), r.y1, 0.0}, -0.5 * std::numbers::pi, length, r.height, m.wall);
  for (const double y : {middle.y() - 0.27 * width, middle.y() + 0.27 * width}) {
    b.floor({middle.x(), y, 0.004}, 0.0, length, 0.12, m.yellow);
  }
}

void add_structure(SceneBuilder& b, const HallMaterials& m, const Room& r, const Footprint& way,
                   Random& random) {
  for (double x = r.x0 + 2.0; x < r.x1 - 1.0; x += 4.0) {  // beams and columns
    b.box({x, 0.5 * (r.y0 + r.y1), r.height - 0.6}, 0.0, {0.35, r.y1 - r.y0, 0.5}, m.pipe, m.pipe);
    b.quad({x, 0.5 * (r.y0 + r.y1), r.height - 0.6}, Vec3::UnitY(), Vec3::UnitX(), r.y1 - r.y0,
           0.35, m.pipe);
    for (const double y : {r.y0 + 0.4, r.y1 - 0.4}) {
      b.box({x, y, 0.0}, 0.0, {0.4, 0.4, r.height}, m.pipe, m.pipe);
    }
  }
  const double length = r.x1 - r.x0;
  for (const double z : {0.45 * r.height, 0.62 * r.height, 0.8 * r.height}) {  // pipes on the walls
    for (const double y : {r.y0 + 0.9, r.y1 - 0.9}) {
      b.cylinder({0.5 * (r.x0 + r.x1), y + 0.3 * std::sin(5.0 * z), z}, Vec3::UnitX(),
                 random.uniform(0.06, 0.18), length, m.pipe);
    }
  }
  for (int i = 0; i < 24; ++i) {  // posters and doors
    const bool along_x = random.chance(0.6);
    const double high = random.uniform(0.7, 1.9);
    const double z = random.uniform(0.2, 0.5 * r.height);
    const auto poster = m.posters[static_cast<std::size_t>(random.below(4))];
    const double wide = random.uniform(0.7, 1.6);
    const double out = 0.01 + 0.002 * i;
    if (along_x) {
      const bool left = random.chance(0.5);
      const double x = random.uniform(r.x0 + 2.0, r.x1 - 2.0);
      b.wall({x, left ? r.y1 - out : r.y0 + out, z},
             left ? -0.5 * std::numbers::pi : 0.5 * std::numbers::pi, wide, high, poster);
    } else {
      const bool far = random.chance(0.5);
      const double y = random.uniform(r.y0 + 2.0, r.y1 - 2.0);
      b.wall({far ? r.x1 - out : r.x0 + out, y, z}, far ? std::numbers::pi : 0.0, wide, high,
             poster);
    }
  }
  for (int i = 0; i < 40; ++i) {  // free columns and tanks, some of them near the way
    const double x = random.uniform(r.x0 + 1.5, r.x1 - 1.5);
    const double y = random.uniform(r.y0 + 1.5, r.y1 - 1.5);
    const bool tank = random.chance(0.3);
    const double radius = tank ? random.uniform(0.4, 0.9) : random.uniform(0.05, 0.16);
    if (way.near(x, y, radius + 0.9)) continue;
    const double high = tank ? random.uniform(1.2, 2.8) : r.height;
    b.cylinder({x, y, 0.5 * high}, Vec3::UnitZ(), radius, high, m.pipe);
  }
}

void add_machines(SceneBuilder& b, const HallMaterials& m, const Room& r, const Footprint& way,
                  Random& random) {
  for (int i = 0; i < 90; ++i) {
    const double x = random.uniform(r.x0 + 1.5, r.x1 - 1.5);
    const double y = random.uniform(r.y0 + 1.5, r.y1 - 1.5);
    const bool crate = random.chance(0.5);
    const double yaw =
        crate ? random.uniform(0.0, std::numbers::pi) : 0.5 * std::numbers::pi * random.below(2);
    const double side = random.uniform(0.5, 1.1);
    const Vec3 size =
        crate ? Vec3(side, side, side)
              : Vec3(random.uniform(0.8, 2.4), random.uniform(0.7, 1.5), random.uniform(0.9, 2.8));
    const double reach = 0.5 * std::hypot(size.x(), size.y());
    // Low things may stand below the way.
    bool free = !way.near_point({x, y, size.z()}, reach + 0.5);
    for (double z = 0.0; z < size.z(); z += 0.3) free &= !way.near_point({x, y, z}, reach + 0.5);
    if (!free) continue;
    const auto& kinds = crate ? m.crates : m.machines;
    const int sides = kinds[static_cast<std::size_t>(random.below(4))];
    b.box({x, y, 0.0}, yaw, size, sides, sides);
    Surface& dark = b.shadow({x, y, 0.0}, yaw, size.x() * 1.6, size.y() * 1.6, m.shadow);
    dark.light = 0.3F;
    if (!crate && random.chance(0.5) && !way.near_point({x, y, size.z() + 0.5}, reach + 0.7)) {
      b.box({x, y, size.z()}, yaw, {0.5 * size.x(), 0.5 * size.y(), 0.5},
            kinds[static_cast<std::size_t>(random.below(4))], sides);
    }
  }
}

}  // namespace

Scene build_hall(const Motion& motion, std::uint64_t seed) {
  SceneBuilder b;
  b.scene().to_sun = Vec3(0.3, 0.2, 0.93).normalized();
  b.scene().ambient = 0.6F;
  b.scene().sun = 0.35F;
  b.scene().exposure_s = 0.008;
  const HallMaterials m = hall_materials(b, combine(seed, 31));
  const Footprint way(motion);
  const Room room{way.low().x() - 4.0, way.high().x() + 4.0, way.low().y() - 3.5,
                  way.high().y() + 3.5, std::max(5.0, way.high().z() + 2.0)};
  Random random(combine(seed, 32));
  add_shell(b, m, room);
  add_structure(b, m, room, way, random);
  add_machines(b, m, room, way, random);
  light_evenly(b, 0, random);
  return b.take();
}

}  // namespace sovo::sim
