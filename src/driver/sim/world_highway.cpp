#include <algorithm>
#include <cmath>
#include <numbers>

#include "sovo/driver/sim/canvas.h"
#include "sovo/driver/sim/noise.h"
#include "sovo/driver/sim/random.h"
#include "sovo/driver/sim/road_line.h"
#include "sovo/driver/sim/surroundings.h"
#include "sovo/driver/sim/traffic.h"
#include "sovo/driver/sim/vehicles.h"
#include "sovo/driver/sim/world.h"

namespace sovo::sim {
namespace {

// Places across the road, to the left of the camera's way, which is the middle of the right lane
// [m].
constexpr double kLane = 3.6;
constexpr double kShoulder = -4.6;             ///< Right edge of the asphalt.
constexpr double kEdge = 1.5 * kLane + 0.6;    ///< Its left edge.
constexpr double kMedian = 3.2;                ///< Width of the green between the carriageways.
constexpr double kOpposite = kEdge + kMedian;  ///< Right edge of the other carriageway.
constexpr double kOppositeWidth = kEdge - kShoulder;

struct HighwayMaterials {
  int field = 0, verge = 0, asphalt = 0, line = 0, seam = 0, rail = 0, post = 0, concrete = 0,
      sign = 0, bark = 0, wood = 0, glass = 0, shadow = 0, block_shadow = 0, lorry = 0;
  std::vector<int> cars;
  std::vector<int> leaves;
};

/// The face of a crash barrier: two waves of steel along x, the same from end to end.
ImageF rail_pattern(int size, std::uint64_t seed) {
  Canvas canvas(size, 0.5F);
  for (int y = 0; y < size; ++y) {
    const double wave = std::cos(4.0 * std::numbers::pi * (y + 0.5) / size);
    for (int x = 0; x < size; ++x) canvas.image().at(x, y) = static_cast<float>(0.5 + 0.4 * wave);
  }
  canvas.add_noise(8, 6, 0.7F, 0.12F, seed);
  return canvas.image();
}

void make_road(SceneBuilder& b, HighwayMaterials* m, int noise, std::uint64_t seed) {
  const int grain = b.texture(asphalt_pattern(512, seed));
  const int rail = b.texture(rail_pattern(128, seed + 1));
  m->asphalt = b.material(0.3F, {on_world(layer(grain, 2.3, Blend::kAdd, 0.22F, 0.4)),
                                 on_world(layer(grain, 9.7, Blend::kAdd, 0.1F, 1.5)),
                                 on_world(layer(noise, 31.0, Blend::kMultiply, 0.35F, 0.9))});
  m->line = b.material(0.8F, {on_world(layer(grain, 2.3, Blend::kMultiply, 0.35F))});
  m->seam = b.material(0.17F, {on_world(layer(grain, 0.9, Blend::kMultiply, 0.5F))});
  m->rail = b.material(0.5F, {stretched(rail, 8.0, 0.31, Blend::kMultiply, 0.7F)});
  m->post = b.material(0.42F, {layer(noise, 0.7, Blend::kMultiply, 0.5F)});
  m->concrete =
      b.material(0.5F, {layer(b.texture(concrete_pattern(512, seed + 2)), 4.7, Blend::kAdd, 0.6F),
                        layer(noise, 13.0, Blend::kMultiply, 0.5F)});
}

HighwayMaterials highway_materials(SceneBuilder& b, std::uint64_t seed) {
  HighwayMaterials m;
  const int noise = b.texture(noise_pattern(512, 4, 8, 0.75F, seed));
  const int grass = b.texture(grass_pattern(512, seed + 1));
  make_road(b, &m, noise, seed + 10);
  m.field = b.material(0.03F, {layer(grass, 5.1, Blend::kMax, 0.8F, 0.5),
                               layer(noise, 43.0, Blend::kMultiply, 1.2F, 0.3),
                               layer(noise, 3.1, Blend::kMultiply, 0.6F, 1.3)});
  m.verge = b.material(0.04F, {on_world(layer(grass, 2.9, Blend::kMax, 1.0F, 1.1)),
                               on_world(layer(noise, 7.7, Blend::kMultiply, 0.8F, 0.3))});
  m.sign = b.material(
      0.1F, {stretched(b.texture(machine_pattern(128, seed + 2)), 3.0, 2.0, Blend::kMax, 1.1F)});
  m.lorry =
      b.material(0.1F, {layer(b.texture(machine_pattern(256, seed + 3)), 2.6, Blend::kMax, 1.0F),
                        layer(noise, 1.9, Blend::kMultiply, 0.5F, 0.4)});
  m.bark = b.material(0.24F, {stretched(noise, 0.4, 2.3, Blend::kAdd, 0.6F)});
  m.wood = b.material(0.02F, {layer(grass, 6.3, Blend::kMax, 0.55F, 0.2),
                              layer(noise, 9.0, Blend::kMultiply, 1.8F, 1.1)});
  m.glass = b.material(0.12F, {layer(noise, 2.7, Blend::kAdd, 0.45F, 0.2)});
  m.shadow = b.cutout(spot_cutout(128, 0.35, 2.4, seed + 4), 1.0, 1.0);
  m.block_shadow = b.cutout(spot_cutout(128, 0.5, 0.2, seed + 5), 1.0, 1.0);
  m.cars = car_paints(b, seed + 30);
  for (unsigned i = 0; i < 3; ++i) {
    m.leaves.push_back(b.cutout(leaf_cutout(256, 230, 0.07, seed + 40 + i), 3.1, 3.1));
  }
  return m;
}

class HighwayBuilder {
 public:
  HighwayBuilder(SceneBuilder& b, const HighwayMaterials& m, const Motion& motion,
                 std::uint64_t seed)
      : b_(b), m_(m), way_(motion), line_(road_line(motion, 30.0, 320.0)), random_(seed) {}

  void build() {
    b_.floor(Vec3(0.0, 0.0, -0.03), 0.0, 20000.0, 20000.0, m_.field).unbounded = true;
    pave();
    rails(kShoulder - 0.5, false);
    rails(kEdge + 0.4, true);
    rails(kOpposite - 0.4, false);
    furniture();
    bridges();
    woods();
  }

 private:
  double begin() const { return line_.front().s; }
  double end() const { return line_.back().s; }

  void strip(const WayPoint& p, double right, double left, double z, double length, int material) {
    b_.floor(beside(p, 0.5 * (right + left), z), p.heading, length, left - right, material);
  }

  /// Both carriageways in pieces, with their lines; seven heights keep overlapping pieces apart.
  void pave() {
    constexpr double kPiece = 6.0;
    int number = 0;
    for (double s = begin(); s < end() - kPiece; s += kPiece, ++number) {
      const WayPoint p = piece_of(line_, s, kPiece);
      const double z = 0.0015 * (number % 7);
      const double length = kPiece + 24.0 * std::abs(place_on(line_, s + kPiece).heading -
                                                     place_on(line_, s).heading);
      strip(p, kShoulder - 3.0, kShoulder, z - 0.012, length, m_.verge);
      strip(p, kEdge, kOpposite, z - 0.012, length, m_.verge);
      strip(p, kShoulder, kEdge, z, length, m_.asphalt);
      strip(p, kOpposite, kOpposite + kOppositeWidth, z, length, m_.asphalt);
      const double line_z = z + 0.003;
      strip(p, -0.5 * kLane - 0.2, -0.5 * kLane + 0.1, line_z, length, m_.line);
      strip(p, 1.5 * kLane, 1.5 * kLane + 0.25, line_z, length, m_.line);
      strip(p, kOpposite + 0.5, kOpposite + 0.75, line_z, length, m_.line);
      // Six metres of line, twelve without.
      if (number % 3 == 0) strip(p, 0.5 * kLane - 0.08, 0.5 * kLane + 0.08, line_z, 6.0, m_.line);
      if (random_.chance(0.06)) mended(p, line_z);
    }
  }

  /// A seam across the road, or a patch that was mended.
  void mended(const WayPoint& p, double z) {
    if (random_.chance(0.5)) {
      b_.floor(beside(p, 0.5 * kLane, z), p.heading + 0.5 * std::numbers::pi, 2.0 * kLane, 0.12,
               m_.seam);
      return;
    }
    const double left = random_.uniform(-1.2, 1.2) + (random_.chance(0.5) ? kLane : 0.0);
    b_.floor(beside(p, left, z), p.heading, random_.uniform(0.8, 4.0), random_.uniform(0.4, 1.4),
             m_.seam);
  }

  /// A crash barrier on posts, four metres apart and all alike; `right`: seen from the way.
  void rails(double left, bool right) {
    constexpr double kPiece = 4.0;
    for (double s = begin(); s < end() - kPiece; s += kPiece) {
      const WayPoint p = piece_of(line_, s, kPiece);
      const double bend = place_on(line_, s + kPiece).heading - place_on(line_, s).heading;
      const double length = kPiece - left * bend + 0.02;
      const double facing = p.heading + (right ? -0.5 : 0.5) * std::numbers::pi;
      Surface& rail = b_.wall(beside(p, left, 0.44), facing, length, 0.31, m_.rail);
      rail.two_sided = true;
      rail.foot_shade = 0.0F;
      b_.box(beside(p, left + (right ? 0.1 : -0.1)), p.heading, {0.1, 0.06, 0.62}, m_.post,
             m_.post);
    }
  }

  /// Posts every fifty metres, and signs now and then.
  void furniture() {
    for (double s = begin(); s < end(); s += 50.0) {
      const WayPoint p = place_on(line_, s);
      b_.box(beside(p, kShoulder - 0.9), p.heading, {0.12, 0.12, 1.0}, m_.line, m_.line);
    }
    for (double s = begin() + random_.uniform(20.0, 120.0); s < end();
         s += random_.uniform(110.0, 260.0)) {
      const WayPoint p = place_on(line_, s);
      const double size = random_.uniform(1.0, 3.0);
      const double left = kShoulder - 1.6 - 0.5 * size;
      b_.cylinder(beside(p, left, 1.5), Vec3::UnitZ(), 0.06, 3.0, m_.post);
      Surface& sign =
          b_.wall(beside(p, left, 2.2), p.heading + std::numbers::pi, size, 0.66 * size, m_.sign);
      sign.two_sided = true;
      sign.foot_shade = 0.0F;
    }
  }

  /// Bridges over the road.
  void bridges() {
    for (double s = begin() + random_.uniform(150.0, 350.0); s < end();
         s += random_.uniform(300.0, 600.0)) {
      const WayPoint p = place_on(line_, s);
      const double middle = 0.5 * (kEdge + kOpposite);
      const double across = p.heading + 0.5 * std::numbers::pi;
      b_.box(beside(p, middle, 5.2), across, {60.0, 9.0, 1.3}, m_.concrete, m_.concrete);
      for (const double left : {kShoulder - 3.0, middle, kOpposite + kOppositeWidth + 3.0}) {
        b_.box(beside(p, left), across, {0.9, 7.0, 5.2}, m_.concrete, m_.concrete);
      }
      b_.shadow(beside(p, middle), across, 62.0, 13.0, m_.block_shadow);
    }
  }

  void plant(const Vec3& foot, double height, double crown) {
    if (way_.near(foot.x(), foot.y(), 8.0)) return;
    SceneBuilder::Tree tree;
    tree.foot = foot;
    tree.height = height;
    tree.crown = crown;
    tree.bunches = 14;
    tree.trunk = m_.bark;
    tree.leaves = m_.leaves;
    tree.shadow = m_.shadow;
    tree.seed = random_.bits();
    b_.tree(tree);
  }

  /// Bushes and trees far off the road, and the edges of woods behind.
  void woods() {
    for (const bool left : {false, true}) {
      const auto aside = [left](double out) {
        return left ? kOpposite + kOppositeWidth + out : kShoulder - out;
      };
      for (double s = begin(); s < end(); s += random_.uniform(9.0, 40.0)) {
        const WayPoint p = place_on(line_, s);
        const double out = random_.uniform(7.0, 60.0);
        if (random_.chance(0.5)) {
          plant(beside(p, aside(out)), random_.uniform(5.0, 11.0), random_.uniform(1.8, 3.4));
        } else {
          plant(beside(p, aside(0.6 * out + 3.0)), random_.uniform(1.9, 2.6), 1.1);
        }
      }
      for (double s = begin(); s < end(); s += random_.uniform(70.0, 180.0)) {
        const WayPoint p = place_on(line_, s);
        const Vec3 foot = beside(p, aside(random_.uniform(70.0, 160.0)));
        const double length = random_.uniform(40.0, 110.0);
        if (way_.near_box(foot.x(), foot.y(), p.heading, length, 30.0, 11.0)) continue;
        b_.box(foot, p.heading, {length, 30.0, random_.uniform(8.0, 16.0)}, m_.wood, m_.wood);
      }
    }
  }

  SceneBuilder& b_;
  const HighwayMaterials& m_;
  Footprint way_;
  std::vector<WayPoint> line_;
  Random random_;
};

}  // namespace

Scene build_highway(const Motion& motion, std::uint64_t seed, Traffic traffic) {
  SceneBuilder b;
  Scene& scene = b.scene();
  scene.to_sun = Vec3(-0.3, 0.55, 0.78).normalized();
  scene.ambient = 0.5F;
  scene.sun = 1.0F;
  scene.exposure_s = 0.002;
  const HighwayMaterials m = highway_materials(b, combine(seed, 61));
  scene.sky = {0.45F, 0.7F, b.texture(cloud_pattern(512, combine(seed, 62))),
               b.texture(noise_pattern(512, 8, 6, 0.6F, combine(seed, 63))), 0.06F};
  scene.haze = 0.0015;
  scene.haze_colour = 0.6F;
  HighwayBuilder(b, m, motion, combine(seed, 64)).build();
  constexpr Lanes kLanes = {.other = kLane,
                            .oncoming = kOpposite + 0.5 * kOppositeWidth,
                            .faster = 8.0,
                            .oncoming_speed = 27.0};
  add_traffic(traffic, motion, kLanes, {m.cars, m.lorry, m.glass, m.block_shadow}, b);
  return b.take();
}

}  // namespace sovo::sim
