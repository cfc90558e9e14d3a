#include <algorithm>
#include <cmath>
#include <numbers>

#include "sovo/driver/sim/canvas.h"
#include "sovo/driver/sim/noise.h"
#include "sovo/driver/sim/random.h"
#include "sovo/driver/sim/surroundings.h"
#include "sovo/driver/sim/world.h"

namespace sovo::sim {
namespace {

/// Daisies, clover leaves and dry leaves, far between.
ImageF flower_pattern(int size, std::uint64_t seed) {
  Random random(seed);
  Canvas canvas(size, 0.0F);
  for (int i = 0; i < 60; ++i) {
    const double x = random.uniform();
    const double y = random.uniform();
    const double r = random.uniform(0.0018, 0.0032);
    for (int k = 0; k < 7; ++k) {
      const double a = 2.0 * std::numbers::pi * k / 7.0 + 0.3 * i;
      canvas.ellipse(x + 1.1 * r * std::cos(a), y + 1.1 * r * std::sin(a), 0.8 * r, 0.4 * r, a,
                     random.uniform_float(0.8, 1.0));
    }
    canvas.ellipse(x, y, 0.6 * r, 0.6 * r, 0.0, 0.6F);
  }
  for (int i = 0; i < 240; ++i) {
    const double r = random.uniform(0.001, 0.005);
    canvas.ellipse(random.uniform(), random.uniform(), r, 0.55 * r,
                   random.uniform(0.0, std::numbers::pi), random.uniform_float(0.25, 0.75));
  }
  return canvas.image();
}

struct LawnMaterials {
  int grass, hedge, bark, wall, roof, fence, shadow;
  std::vector<int> tufts;
  std::vector<int> leaves;
};

LawnMaterials lawn_materials(SceneBuilder& b, std::uint64_t seed) {
  LawnMaterials m;
  const int grass = b.texture(grass_pattern(1024, seed));
  const int flowers = b.texture(flower_pattern(1024, seed + 1));
  const int noise = b.texture(noise_pattern(512, 4, 7, 0.7F, seed + 2));
  Material lawn;
  lawn.base = 0.02F;
  lawn.layers = {
      layer(grass, 2.3, Blend::kMax, 1.0F, 0.3), layer(grass, 3.13, Blend::kMax, 0.9F, 1.9),
      layer(noise, 9.7, Blend::kMultiply, 1.3F, 0.7), layer(flowers, 5.9, Blend::kMax, 0.9F, 1.1)};
  m.grass = b.material(lawn);
  Material hedge;
  hedge.base = 0.05F;
  hedge.layers = {layer(grass, 2.9, Blend::kMax, 0.85F, 0.4),
                  layer(grass, 4.7, Blend::kMax, 0.8F, 2.1),
                  layer(noise, 3.3, Blend::kMultiply, 2.0F, 0.2)};
  m.hedge = b.material(hedge);
  Material bark;
  bark.base = 0.25F;
  bark.layers = {stretched(noise, 0.5, 2.7, Blend::kAdd, 0.6F)};
  m.bark = b.material(bark);
  Material wall;
  wall.base = 0.0F;
  wall.layers = {
      stretched(b.texture(facade_pattern(512, 2, seed + 3)), 5.0, 2.9, Blend::kMax, 1.0F),
      layer(noise, 7.7, Blend::kMultiply, 0.5F, 0.0)};
  m.wall = b.material(wall);
  Material roof;
  roof.base = 0.28F;
  roof.layers = {layer(b.texture(brick_pattern(256, 16, seed + 4)), 4.0, Blend::kAdd, 0.5F)};
  m.roof = b.material(roof);
  Material fence;
  fence.base = 0.0F;
  fence.layers = {layer(b.texture(crate_pattern(512, seed + 5)), 1.9, Blend::kMax, 0.9F,
                        0.5 * std::numbers::pi),
                  layer(noise, 5.3, Blend::kMultiply, 0.8F)};
  m.fence = b.material(fence);
  m.shadow = b.cutout(spot_cutout(256, 0.3, 2.6, seed + 6), 1.0, 1.0);
  for (int i = 0; i < 3; ++i) {
    m.tufts.push_back(
        b.cutout(tuft_cutout(128, 26, seed + 10 + static_cast<unsigned>(i)), 0.3, 0.3));
    m.leaves.push_back(
        b.cutout(leaf_cutout(256, 230, 0.07, seed + 20 + static_cast<unsigned>(i)), 2.0, 2.0));
  }
  return m;
}

void add_tufts(SceneBuilder& b, const LawnMaterials& m, const Footprint& way, Random& random) {
  const double area =
      (way.high().x() - way.low().x() + 8.0) * (way.high().y() - way.low().y() + 8.0);
  const int count = static_cast<int>(std::min(1500.0, 2.2 * area));
  for (int i = 0; i < count; ++i) {
    const double x = random.uniform(way.low().x() - 4.0, way.high().x() + 4.0);
    const double y = random.uniform(way.low().y() - 4.0, way.high().y() + 4.0);
    const double size = random.uniform(0.1, 0.26);
    Surface& s = b.wall({x, y, -0.01}, random.uniform(0.0, 2.0 * std::numbers::pi), size, size,
                        m.tufts[static_cast<std::size_t>(random.below(3))]);
    s.two_sided = true;
    s.foot_shade = 0.0F;
    s.light = random.uniform_float(0.8, 1.15);
  }
}

/// Hedges, a fence and a house around the lawn.
void add_borders(SceneBuilder& b, const LawnMaterials& m, const Footprint& way, Random& random) {
  const Vec3 middle = 0.5 * (way.low() + way.high());
  const double rx = 0.5 * (way.high().x() - way.low().x()) + 11.0;
  const double ry = 0.5 * (way.high().y() - way.low().y()) + 11.0;
  for (int side = 0; side < 4; ++side) {
    const double yaw = 0.5 * std::numbers::pi * side;
    const double out = side % 2 == 0 ? rx : ry;
    const double width = 2.0 * (side % 2 == 0 ? ry : rx);
    for (double along = -0.5 * width; along < 0.5 * width; along += 3.0) {
      const double x = middle.x() + out * std::cos(yaw) - (along + 1.5) * std::sin(yaw);
      const double y = middle.y() + out * std::sin(yaw) + (along + 1.5) * std::cos(yaw);
      const double deep = random.uniform(0.8, 1.3);
      const double high = side == 1 ? 1.8 : random.uniform(1.5, 2.1);
      const std::size_t first = b.box({x, y, 0.0}, yaw, {side == 1 ? 0.1 : deep, 3.0, high},
                                      side == 1 ? m.fence : m.hedge, m.hedge);
      for (std::size_t i = first; i < first + 4; ++i) {
        b.scene().surfaces[i].texture_x = 3.0 * along + 17.0 * side;
      }
    }
  }
  const Vec3 house(middle.x() + rx + 7.0, middle.y() + 2.0, 0.0);
  b.box(house, 0.0, {9.0, 15.0, 5.8}, m.wall, m.roof);
  b.box(house + Vec3(0, 0, 5.8), 0.0, {6.0, 13.0, 1.8}, m.roof, m.roof);
}

void add_trees(SceneBuilder& b, const LawnMaterials& m, const Footprint& way, Random& random) {
  const Vec3 middle = 0.5 * (way.low() + way.high());
  const double reach =
      0.5 * std::hypot(way.high().x() - way.low().x(), way.high().y() - way.low().y());
  for (int i = 0; i < 9; ++i) {
    const double around = 2.0 * std::numbers::pi * (i + random.uniform(0.1, 0.7)) / 9.0;
    const double out = reach + random.uniform(2.5, 5.5);
    SceneBuilder::Tree tree;
    tree.foot = {middle.x() + out * std::cos(around), middle.y() + out * std::sin(around), 0.0};
    if (way.near(tree.foot.x(), tree.foot.y(), 3.0)) continue;
    tree.height = random.uniform(4.5, 7.5);
    tree.crown = random.uniform(1.5, 2.4);
    tree.bunches = 22;
    tree.trunk = m.bark;
    tree.leaves = m.leaves;
    tree.shadow = m.shadow;
    tree.seed = random.bits();
    b.tree(tree);
  }
  // Boughs out of sight throw patches of shade onto the lawn.
  for (int i = 0; i < 14; ++i) {
    const double x = random.uniform(way.low().x() - 3.0, way.high().x() + 3.0);
    const double y = random.uniform(way.low().y() - 3.0, way.high().y() + 3.0);
    b.shadow({x, y, 0.0}, random.uniform(0.0, std::numbers::pi), random.uniform(1.2, 3.6),
             random.uniform(0.8, 2.2), m.shadow);
  }
}

}  // namespace

Scene build_lawn(const Motion& motion, std::uint64_t seed) {
  SceneBuilder b;
  b.scene().to_sun = Vec3(-0.55, 0.35, 0.75).normalized();
  b.scene().ambient = 0.5F;
  b.scene().sun = 1.1F;
  b.scene().exposure_s = 0.003;
  const LawnMaterials m = lawn_materials(b, combine(seed, 11));
  b.scene().sky = {0.75F, 1.0F, b.texture(cloud_pattern(512, seed)),
                   b.texture(noise_pattern(512, 8, 6, 0.6F, seed + 7)), 0.1F};
  b.scene().haze = 0.001;
  b.scene().haze_colour = 0.8F;
  Random random(combine(seed, 12));
  const Footprint way(motion);
  b.floor({0.0, 0.0, 0.0}, 0.0, 4000.0, 4000.0, m.grass).unbounded = true;
  add_tufts(b, m, way, random);
  add_borders(b, m, way, random);
  add_trees(b, m, way, random);
  return b.take();
}

}  // namespace sovo::sim
