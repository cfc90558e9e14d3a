// Time of a scale optimization: 2000 points at 752x480, the right pyramid included and apart.

#include <benchmark/benchmark.h>

#include "scale/scale_test_support.h"
#include "sovo/scale/scale_optimizer.h"

namespace sovo {
namespace {

struct Setup {
  test::StereoView view;
  KeyframeSnapshot keyframe;
  ImagePyramidPtr right;
};

CameraModel enlarged(CameraModel camera) {
  const double factor = 752.0 / camera.width;
  camera.width = 752;
  camera.height = 480;
  camera.fx *= factor;
  camera.fy *= factor;
  camera.cx *= factor;
  camera.cy = (camera.cy - 120.0) * factor + 240.0;
  return camera;
}

const Setup& setup(test::Right kind, double log_scale) {
  static std::map<std::pair<test::Right, double>, Setup> setups;
  const auto [found, fresh] = setups.try_emplace({kind, log_scale});
  Setup& s = found->second;
  if (!fresh) return s;
  StereoRig rig = test::make_rig(kind);
  rig.left = enlarged(rig.left);
  rig.right = enlarged(rig.right);
  s.view = test::render_view(test::scene(1), rig);
  test::add_noise(2.0, 1, &s.view.left);
  test::add_noise(2.0, 2, &s.view.right);
  const test::PointErrors errors{
      .log_scale = log_scale, .relative_noise = 0.02, .outliers = 0.05, .count = 2000};
  s.keyframe = test::make_keyframe(s.view, test::scene(1), errors);
  s.right = test::pyramid_of(s.view.right);
  return s;
}

void run(benchmark::State& state, test::Right kind, double log_scale, bool cold,
         const ScaleOptimizerConfig& config) {
  const Setup& s = setup(kind, log_scale);
  const ScaleOptimizer optimizer(config, s.view.rig);
  ScaleEstimate found;
  for (auto _ : state) {
    found = optimizer.estimate(s.keyframe, *s.right, cold);
    benchmark::DoNotOptimize(found);
  }
  state.counters["iterations"] = found.iterations;
  state.counters["error_permille"] = 1000.0 * (found.log_scale - log_scale);
}

void track(benchmark::State& state, test::Right kind) { run(state, kind, 0.01, false, {}); }
void cold_start(benchmark::State& state, test::Right kind) { run(state, kind, 1.5, true, {}); }
void paper(benchmark::State& state, test::Right kind) {
  ScaleOptimizerConfig config;
  config.method = ScaleMethod::kPaper;
  run(state, kind, 0.01, false, config);
}

void right_pyramid(benchmark::State& state) {
  const Setup& s = setup(test::Right::kRectified, 0.01);
  for (auto _ : state) {
    state.PauseTiming();
    ImageF image = s.view.right;
    state.ResumeTiming();
    const ImagePyramid pyramid(std::move(image), 4);
    benchmark::DoNotOptimize(pyramid.level(3).data());
  }
}

constexpr auto kUs = benchmark::kMicrosecond;
BENCHMARK_CAPTURE(track, rectified, test::Right::kRectified)->Unit(kUs);
BENCHMARK_CAPTURE(track, radtan, test::Right::kRadtan)->Unit(kUs);
BENCHMARK_CAPTURE(track, equidistant, test::Right::kEquidistant)->Unit(kUs);
BENCHMARK_CAPTURE(cold_start, radtan, test::Right::kRadtan)->Unit(kUs);
BENCHMARK_CAPTURE(cold_start, equidistant, test::Right::kEquidistant)->Unit(kUs);
BENCHMARK_CAPTURE(paper, radtan, test::Right::kRadtan)->Unit(kUs);
BENCHMARK(right_pyramid)->Unit(kUs);

}  // namespace
}  // namespace sovo
