// Time of bundle adjustment: a window of 7 keyframes and 2000 points at 752x480, one thread; the
// whole optimization and one linearization with its normal equations.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <iterator>
#include <random>

#include "vo/window_test_support.h"

namespace sovo {
namespace {

constexpr int kKeyframes = 7;
constexpr std::size_t kPoints = 2000;

CameraModel euroc_camera() { return test::make_camera(752, 480, 458, 457, 367.2, 248.4); }

/// The true window, made once.
const Window& true_window() {
  static const Window window = [] {
    const test::SyntheticScene scene(3);
    Window out(euroc_camera());
    std::vector<SE3> poses;
    for (int i = 0; i < kKeyframes; ++i) poses.push_back(test::keyframe_pose(i));
    for (int i = 0; i < kKeyframes; ++i) {
      const auto k = static_cast<std::size_t>(i);
      Keyframe& keyframe = out.insert(
          test::make_keyframe(static_cast<std::uint32_t>(i),
                              test::scene_view(scene, out.camera(), poses[k]), poses[k]));
      if (i + 1 == kKeyframes) break;
      keyframe.points = test::scene_points(scene, out.camera(), keyframe.image(), poses, i, 9);
      // As many a host as make the window full, in their order.
      std::vector<Point>& points = keyframe.points;
      const std::size_t wanted = kPoints / (kKeyframes - 1) + 1;
      std::vector<Point> kept;
      std::sample(points.begin(), points.end(), std::back_inserter(kept), wanted,
                  std::mt19937(static_cast<unsigned>(i)));
      points = std::move(kept);
    }
    return out;
  }();
  return window;
}

/// The window as a new keyframe finds it: poses and depths off by what tracking and tracing leave.
void disturb(Window* window) {
  std::mt19937 random(11);
  for (int i = 1; i < window->size(); ++i) {
    Vec8 x;
    for (double& value : x) value = test::uniform(random, -1.0, 1.0);
    x.head<3>() *= 0.006;
    x.segment<3>(3) *= 0.0015;
    x[6] *= 0.01;
    (*window)[i].set_x(x);
    (*window)[i].freeze();
  }
  for (int h = 0; h < window->size(); ++h) {
    Keyframe& host = (*window)[h];
    host.outlier_threshold = kPatternSize * WindowConfig().outlier_threshold;
    for (Point& p : host.points) {
      p.rho *= 1.0 + 0.03 * test::uniform(random, -1.0, 1.0);
      for (int t = 0; t < window->size(); ++t) {
        if (t == h) continue;
        p.residuals[static_cast<std::size_t>((*window)[t].slot)].state = ResidualState::kIn;
      }
    }
  }
  window->update_geometry();
}

/// A copy that shares the images.
Window disturbed_window() {
  const Window& truth = true_window();
  Window out(truth.camera());
  for (int i = 0; i < truth.size(); ++i) out.insert(std::make_unique<Keyframe>(truth[i]));
  disturb(&out);
  return out;
}

void optimize(benchmark::State& state) {
  WorkerPool pool(1);
  BundleAdjuster adjuster(WindowConfig(), &pool);
  BundleResult result;
  for ([[maybe_unused]] const auto _ : state) {
    state.PauseTiming();
    Window window = disturbed_window();
    state.ResumeTiming();
    result = adjuster.optimize(&window);
    benchmark::DoNotOptimize(result);
  }
  state.counters["points"] = result.points;
  state.counters["residuals"] = result.residuals;
  state.counters["iterations"] = result.iterations;
}

void linearize_window(benchmark::State& state, bool system) {
  WorkerPool pool(1);
  Window window = disturbed_window();
  PhotometricProblem problem(WindowConfig(), collect_points(&window), &window, &pool);
  const WindowLinearization known = problem.stored();
  WindowLinearization linearized;
  for ([[maybe_unused]] const auto _ : state) {
    problem.linearize(known, {.system = system}, &linearized);
    benchmark::DoNotOptimize(linearized.energy);
  }
  state.counters["ns_a_residual"] = benchmark::Counter(
      static_cast<double>(known.residuals.size()) * 1e-9,
      benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

BENCHMARK(optimize)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(linearize_window, residuals, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(linearize_window, normal_equations, true)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace sovo
