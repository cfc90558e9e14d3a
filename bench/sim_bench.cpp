#include <benchmark/benchmark.h>

#include "sovo/driver/sim/sim_source.h"

namespace sovo::sim {
namespace {

/// Pairs of 640x400 with everything the sensor does, both cameras on one thread.
void render_pairs(benchmark::State& state, World world) {
  SimConfig config;
  config.world = world;
  config.threads = 1;
  Calibration calibration;
  calibration.rig = own_rig(world);
  const Motion motion = own_motion(world);
  const Scene scene = build_scene(world, motion, config.seed);
  Renderer left(scene, calibration.rig.left);
  Renderer right(scene, calibration.rig.right);
  const Sensor sensor(config.sensor, calibration.rig.left.width, calibration.rig.left.height);
  ExposureControl exposure(config.sensor, scene.exposure_s);
  RenderedImage image;
  ImageF blurred;
  const SE3 T_left_right = calibration.rig.T_right_left.inverse();
  double t = 3.0;
  for ([[maybe_unused]] const auto _ : state) {
    for (Renderer* renderer : {&left, &right}) {
      const SE3 pose = renderer == &left ? motion.at(t) : motion.at(t) * T_left_right;
      renderer->render(pose, t, &image);
      Vec6 velocity;
      velocity << 0.0, 0.0, 1.0, 0.0, 0.5, 0.0;
      blur_by_motion(renderer->rays(), image, velocity, exposure.exposure_s(), &blurred);
      benchmark::DoNotOptimize(sensor.expose(blurred, exposure, false, 1));
    }
    t += 0.5;
    if (t > 25.0) t = 3.0;
  }
  state.counters["pairs/s"] =
      benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

BENCHMARK_CAPTURE(render_pairs, lawn, World::kLawn)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(render_pairs, pool, World::kPool)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(render_pairs, street, World::kStreet)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(render_pairs, hall, World::kHall)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(render_pairs, sand, World::kSand)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(render_pairs, highway, World::kHighway)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace sovo::sim
