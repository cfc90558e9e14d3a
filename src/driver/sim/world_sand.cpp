#include <cmath>
#include <numbers>

#include "sovo/driver/sim/canvas.h"
#include "sovo/driver/sim/noise.h"
#include "sovo/driver/sim/random.h"
#include "sovo/driver/sim/surroundings.h"
#include "sovo/driver/sim/world.h"

namespace sovo::sim {
namespace {

/// Ripples that the wind makes: rows along x, bent and broken, with a steep and a flat side.
ImageF ripple_pattern(int size, int rows, std::uint64_t seed) {
  const ImageF bend = noise_pattern(size, 4, 4, 0.5F, seed);
  const ImageF height = noise_pattern(size, 4, 3, 0.5F, seed + 1);
  ImageF image(size, size);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const double phase = 2.0 * std::numbers::pi *
                           (rows * static_cast<double>(y) / size + 2.5 * double{bend.at(x, y)});
      const double slope = std::sin(phase + 0.6 * std::sin(phase));
      image.at(x, y) =
          static_cast<float>(0.5 + 0.8 * slope * std::max(0.0F, height.at(x, y) - 0.25F));
    }
  }
  return image;
}

/// Pebbles, far between, with their shadows.
ImageF pebble_pattern(int size, int count, std::uint64_t seed) {
  Random random(seed);
  Canvas canvas(size, 0.5F);
  for (int i = 0; i < count; ++i) {
    const double x = random.uniform();
    const double y = random.uniform();
    const double r = 0.0012 * std::pow(5.0, random.uniform());
    const double angle = random.uniform(0.0, std::numbers::pi);
    canvas.ellipse(x - 0.7 * r, y - 0.3 * r, r, 0.6 * r, 0.4, 0.25F);
    canvas.ellipse(x, y, r, 0.7 * r, angle, random.uniform_float(0.3, 0.9));
  }
  return canvas.image();
}

struct SandMaterials {
  int sand, rock;
};

SandMaterials sand_materials(SceneBuilder& b, std::uint64_t seed) {
  SandMaterials m;
  const int grain = b.texture(noise_pattern(1024, 16, 7, 0.9F, seed));
  const int soft = b.texture(noise_pattern(512, 4, 4, 0.5F, seed + 1));
  Material sand;
  sand.base = 0.55F;
  sand.layers = {
      layer(b.texture(ripple_pattern(1024, 24, seed + 2)), 2.9, Blend::kMultiply, 0.22F, 0.35),
      layer(grain, 0.71, Blend::kMultiply, 0.16F, 0.3),
      layer(soft, 5.3, Blend::kMultiply, 0.25F, 1.1),
      layer(b.texture(pebble_pattern(1024, 40, seed + 3)), 4.1, Blend::kAdd, 0.7F, 0.8)};
  m.sand = b.material(sand);
  Material rock;
  rock.base = 0.4F;
  rock.layers = {layer(soft, 0.5, Blend::kAdd, 0.5F), layer(grain, 0.9, Blend::kMultiply, 0.8F)};
  m.rock = b.material(rock);
  return m;
}

/// A few rocks beside the way.
void add_rocks(SceneBuilder& b, const SandMaterials& m, const Footprint& way, Random& random) {
  for (int i = 0; i < 40; ++i) {
    const double x = random.uniform(way.low().x() - 25.0, way.high().x() + 25.0);
    const double y = random.uniform(way.low().y() - 25.0, way.high().y() + 25.0);
    const double size = random.uniform(0.1, 0.5);
    const double yaw = random.uniform(0.0, std::numbers::pi);
    if (way.near(x, y, 3.0)) continue;
    b.box({x, y, -0.02}, yaw, {size, 0.7 * size, 0.5 * size}, m.rock, m.rock);
    b.box({x + 0.1 * size, y, 0.3 * size}, yaw + 0.5, {0.6 * size, 0.5 * size, 0.5 * size}, m.rock,
          m.rock);
  }
}

}  // namespace

Scene build_sand(const Motion& motion, std::uint64_t seed) {
  SceneBuilder b;
  Scene& scene = b.scene();
  scene.to_sun = Vec3(-0.7, 0.35, 0.6).normalized();
  scene.ambient = 0.35F;
  scene.sun = 1.2F;
  scene.exposure_s = 0.002;
  const SandMaterials m = sand_materials(b, combine(seed, 51));
  scene.sky = {0.6F, 0.9F, -1, b.texture(noise_pattern(512, 4, 5, 0.4F, seed + 5)), 0.05F};
  scene.haze = 0.004;
  scene.haze_colour = 0.8F;
  Random random(combine(seed, 52));
  const Footprint way(motion);
  b.floor({0.0, 0.0, 0.0}, 0.0, 4000.0, 4000.0, m.sand).unbounded = true;
  add_rocks(b, m, way, random);
  return b.take();
}

}  // namespace sovo::sim
