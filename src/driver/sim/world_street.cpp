#include <algorithm>
#include <cmath>
#include <numbers>

#include "sovo/driver/sim/noise.h"
#include "sovo/driver/sim/random.h"
#include "sovo/driver/sim/road_line.h"
#include "sovo/driver/sim/surroundings.h"
#include "sovo/driver/sim/traffic.h"
#include "sovo/driver/sim/vehicles.h"
#include "sovo/driver/sim/world.h"

namespace sovo::sim {
namespace {

constexpr double kRoad = 7.0;      ///< Width of the road [m].
constexpr double kPavement = 2.6;  ///< Width of each pavement [m].

struct StreetMaterials {
  int ground, road, pavement, kerb, mark, roof, bark, hedge, glass, pole, sign, shadow,
      block_shadow;
  std::vector<int> facades;
  std::vector<int> cars;
  std::vector<int> leaves;
};

void make_ground(SceneBuilder& b, StreetMaterials* m, int noise, std::uint64_t seed) {
  const int asphalt = b.texture(asphalt_pattern(512, seed));
  const int slabs = b.texture(paving_pattern(512, 6, seed + 1));
  const int grass = b.texture(grass_pattern(512, seed + 2));
  m->road = b.material(0.26F, {on_world(layer(asphalt, 2.7, Blend::kAdd, 0.34F, 0.4)),
                               on_world(layer(asphalt, 11.3, Blend::kAdd, 0.22F, 1.5)),
                               on_world(layer(noise, 23.0, Blend::kMultiply, 0.9F, 0.9))});
  m->pavement = b.material(0.4F, {layer(slabs, 3.0, Blend::kAdd, 0.7F),
                                  on_world(layer(noise, 5.3, Blend::kMultiply, 0.8F, 0.7))});
  m->kerb = b.material(0.55F, {on_world(layer(noise, 1.7, Blend::kMultiply, 0.9F))});
  m->mark = b.material(0.85F, {on_world(layer(asphalt, 1.9, Blend::kMultiply, 0.7F))});
  m->ground = b.material(0.03F, {layer(grass, 3.7, Blend::kMax, 0.85F, 0.5),
                                 layer(noise, 13.0, Blend::kMultiply, 1.5F, 0.3),
                                 layer(noise, 1.9, Blend::kMultiply, 0.9F, 1.3)});
  m->hedge = b.material(0.04F, {layer(grass, 2.1, Blend::kMax, 0.8F, 0.2),
                                layer(noise, 1.7, Blend::kMultiply, 1.8F, 1.1)});
}

StreetMaterials street_materials(SceneBuilder& b, int noise, std::uint64_t seed) {
  StreetMaterials m;
  make_ground(b, &m, noise, seed);
  m.roof =
      b.material(0.25F, {layer(b.texture(brick_pattern(256, 16, seed + 4)), 4.0, Blend::kAdd, 0.5F),
                         layer(noise, 5.1, Blend::kMultiply, 1.0F)});
  m.bark = b.material(0.24F, {stretched(noise, 0.4, 2.3, Blend::kAdd, 0.6F)});
  m.glass = b.material(0.12F, {layer(noise, 2.7, Blend::kAdd, 0.45F, 0.2)});
  m.pole = b.material(0.35F, {layer(noise, 0.8, Blend::kAdd, 0.5F)});
  m.sign =
      b.material(0.0F, {layer(b.texture(machine_pattern(128, seed + 5)), 1.5, Blend::kMax, 1.2F)});
  m.shadow = b.cutout(spot_cutout(128, 0.35, 2.4, seed + 6), 1.0, 1.0);
  m.block_shadow = b.cutout(spot_cutout(128, 0.5, 0.2, seed + 7), 1.0, 1.0);
  for (unsigned i = 0; i < 8; ++i) {
    const int facade = b.texture(facade_pattern(512, static_cast<int>(i), seed + 10 + i));
    m.facades.push_back(b.material(0.0F, {stretched(facade, 5.0, 3.1, Blend::kMax, 1.0F),
                                          layer(noise, 11.3, Blend::kMultiply, 0.9F, 0.2),
                                          layer(noise, 2.3, Blend::kMultiply, 0.45F, 1.0)}));
  }
  m.cars = car_paints(b, seed + 30);
  for (unsigned i = 0; i < 3; ++i) {
    m.leaves.push_back(b.cutout(leaf_cutout(256, 230, 0.07, seed + 40 + i), 3.1, 3.1));
  }
  return m;
}

/// Of the vehicles that move; a lorry's sides are painted with large figures.
TrafficMaterials traffic_materials(SceneBuilder& b, const StreetMaterials& m, int noise,
                                   std::uint64_t seed) {
  TrafficMaterials out{m.cars, 0, m.glass, m.block_shadow};
  const int figures = b.texture(machine_pattern(256, seed));
  out.lorry_paint = b.material(0.1F, {layer(figures, 2.6, Blend::kMax, 1.0F),
                                      layer(noise, 1.9, Blend::kMultiply, 0.5F, 0.4)});
  return out;
}

class StreetBuilder {
 public:
  StreetBuilder(SceneBuilder& b, const StreetMaterials& m, const Motion& motion, std::uint64_t seed)
      : b_(b), m_(m), way_(motion), line_(road_line(motion, 20.0, 150.0)), random_(seed) {}

  void build() {
    b_.floor(Vec3(0.0, 0.0, -0.02), 0.0, 20000.0, 20000.0, m_.ground).unbounded = true;
    pave();
    for (const int side : {-1, 1}) {
      houses(side);
      furniture(side);
    }
  }

 private:
  double end() const { return line_.back().s; }
  double begin() const { return line_.front().s; }

  /// Road and pavements in pieces; seven heights keep overlapping pieces apart.
  void pave() {
    int piece = 0;
    for (double s = begin(); s < end() - 3.0; s += 5.0) {
      const WayPoint a = place_on(line_, s);
      const WayPoint c = place_on(line_, s + 5.0);
      const WayPoint p = piece_of(line_, s, 5.0);
      const double length = 5.0 + 8.0 * std::abs(c.heading - a.heading) + 0.1;
      const double z = 0.0015 * (piece++ % 7);
      b_.floor(beside(p, 1.6, z), p.heading, length, kRoad, m_.road);
      for (const int side : {-1, 1}) {
        const double edge = 1.6 + side * 0.5 * kRoad;
        const double walk = edge + side * 0.5 * kPavement;
        b_.floor(beside(p, walk, z - 0.012), p.heading, length, kPavement, m_.pavement).texture_x =
            s;
        b_.floor(beside(p, edge, 0.012 + z), p.heading, length, 0.18, m_.kerb);
      }
      if (piece % 2 == 0) b_.floor(beside(p, 1.6, 0.012 + z), p.heading, 2.6, 0.14, m_.mark);
    }
  }

  void house(const WayPoint& p, int side, double width) {
    const double depth = random_.uniform(8.0, 11.0);
    const int storeys = 2 + random_.below(4);
    const double height = 3.1 * storeys + random_.uniform(0.2, 0.9);
    const double out =
        side * (0.5 * kRoad + kPavement + random_.uniform(0.3, 1.6) + 0.5 * depth) + 1.6;
    const Vec3 foot = beside(p, out);
    const int facade = m_.facades[static_cast<std::size_t>(random_.below(8))];
    const float tint = random_.uniform_float(0.75, 1.15);
    if (way_.near_box(foot.x(), foot.y(), p.heading, width, depth, 4.6)) return;
    const std::size_t first = b_.box(foot, p.heading, {width, depth, height}, facade, m_.roof);
    for (std::size_t i = first; i < first + 4; ++i) {
      Surface& s = b_.scene().surfaces[i];
      s.tint = tint;
      // Storeys begin at the ground; each wall has its own place on the stains.
      s.texture_y = -0.5 * height;
      s.texture_x = 5.0 * random_.below(100) + 2.5;
    }
    if (random_.chance(0.6)) {
      b_.box(foot + Vec3(0, 0, height), p.heading, {width - 1.5, depth - 3.0, 1.6}, m_.roof,
             m_.roof);
    }
    const Vec3 away = -b_.scene().to_sun / b_.scene().to_sun.z() * height;
    b_.shadow(foot + 0.45 * Vec3(away.x(), away.y(), 0.0), p.heading,
              width + 0.9 * std::abs(away.x()), depth + 0.9 * std::abs(away.y()), m_.block_shadow);
  }

  void houses(int side) {
    double s = begin();
    while (s < end() - 12.0) {
      const double width = random_.uniform(9.0, 17.0);
      if (random_.chance(0.8)) {
        house(place_on(line_, s + 0.5 * width), side, width);
      } else {
        garden(place_on(line_, s + 0.5 * width), side, width);
      }
      s += width + (random_.chance(0.35) ? random_.uniform(1.5, 5.0) : 0.05);
    }
  }

  /// A hedge, and a tree behind it.
  void garden(const WayPoint& p, int side, double width) {
    const double out = side * (0.5 * kRoad + kPavement + 1.0) + 1.6;
    const Vec3 foot = beside(p, out);
    if (way_.near_box(foot.x(), foot.y(), p.heading, width, 0.8, 4.2)) return;
    b_.box(foot, p.heading, {width - 0.8, 0.8, random_.uniform(1.1, 1.9)}, m_.hedge, m_.hedge);
    plant(beside(p, out + side * 4.0), random_.uniform(6.0, 9.0), random_.uniform(2.0, 3.0));
  }

  void plant(const Vec3& foot, double height, double crown) {
    if (way_.near(foot.x(), foot.y(), 3.4)) return;
    SceneBuilder::Tree tree;
    tree.foot = foot;
    tree.height = height;
    tree.crown = crown;
    tree.bunches = 18;
    tree.trunk = m_.bark;
    tree.leaves = m_.leaves;
    tree.shadow = m_.shadow;
    tree.seed = random_.bits();
    b_.tree(tree);
  }

  void car(const WayPoint& p, double left) {
    const Vec3 foot = beside(p, left, 0.12);
    if (way_.near_box(foot.x(), foot.y(), p.heading, 4.4, 1.8, 1.6)) return;
    const int paint = m_.cars[static_cast<std::size_t>(random_.below(5))];
    add_car(b_, {paint, m_.glass, m_.block_shadow}, foot, p.heading);
  }

  void furniture(int side) {
    const double kerb = 0.5 * kRoad;
    for (double s = begin(); s < end(); s += random_.uniform(5.5, 12.0)) {
      const WayPoint p = place_on(line_, s);
      const double what = random_.uniform();
      const double out = side * (kerb + 0.7) + 1.6;
      const Vec3 foot = beside(p, out);
      if (what < 0.42) {
        car(p, side * (kerb - 1.0) + 1.6);
      } else if (what < 0.66) {
        plant(foot, random_.uniform(5.0, 7.5), random_.uniform(1.5, 2.3));
      } else if (what < 0.86 && !way_.near(foot.x(), foot.y(), 1.8)) {
        b_.cylinder(foot + Vec3(0, 0, 3.0), Vec3::UnitZ(), 0.09, 6.0, m_.pole);
      } else if (!way_.near(foot.x(), foot.y(), 1.8)) {
        b_.cylinder(foot + Vec3(0, 0, 1.2), Vec3::UnitZ(), 0.05, 2.4, m_.pole);
        Surface& sign =
            b_.wall(foot + Vec3(0, 0, 1.7), p.heading + std::numbers::pi, 0.7, 0.7, m_.sign);
        sign.two_sided = true;
        b_.box(beside(p, out + side * 1.2), p.heading, {0.6, 0.5, 1.1}, m_.sign, m_.sign);
      }
    }
  }

  SceneBuilder& b_;
  const StreetMaterials& m_;
  Footprint way_;
  std::vector<WayPoint> line_;
  Random random_;
};

}  // namespace

Scene build_street(const Motion& motion, std::uint64_t seed, Traffic traffic) {
  SceneBuilder b;
  b.scene().to_sun = Vec3(0.35, -0.5, 0.79).normalized();
  b.scene().ambient = 0.55F;
  b.scene().sun = 1.0F;
  b.scene().exposure_s = 0.003;
  const int noise = b.texture(noise_pattern(512, 4, 8, 0.75F, combine(seed, 41)));
  const StreetMaterials m = street_materials(b, noise, combine(seed, 42));
  b.scene().sky = {0.8F, 1.1F, b.texture(cloud_pattern(512, combine(seed, 43))),
                   b.texture(noise_pattern(512, 8, 6, 0.6F, combine(seed, 44))), 0.12F};
  b.scene().haze = 0.0018;
  b.scene().haze_colour = 0.8F;
  StreetBuilder(b, m, motion, combine(seed, 45)).build();
  constexpr Lanes kLanes = {.other = 2.3, .oncoming = 2.3, .faster = 5.0, .oncoming_speed = 10.0};
  add_traffic(traffic, motion, kLanes, traffic_materials(b, m, noise, combine(seed, 46)), b);
  return b.take();
}

}  // namespace sovo::sim
