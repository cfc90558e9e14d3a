// Time of the selection of a keyframe's 400 pixels at 752x480 and 1392x512: without and with a
// mask, as undistortion leaves one, and with so little texture that the threshold comes down.

#include <benchmark/benchmark.h>

#include <random>
#include <utility>
#include <vector>

#include "sovo/vo/pixel_selector.h"

namespace sovo {
namespace {

constexpr int kWanted = 400;
/// Images in turn, so that none is in a cache near by, as none of a new keyframe is.
constexpr std::size_t kImages = 12;

/// Noise about a middle grey, smoothed along the rows.
ImagePyramid textured(int width, int height, float amplitude, unsigned seed) {
  std::mt19937 random(seed);
  ImageF image(width, height);
  float value = 0.0F;
  for (std::size_t i = 0; i < image.size(); ++i) {
    const float noise = static_cast<float>(random() % 1000U) / 1000.0F - 0.5F;
    value = 0.6F * value + noise;
    image.data()[i] = 128.0F + amplitude * value;
  }
  return {std::move(image), ImagePyramid::num_levels_for(width, height)};
}

void select(benchmark::State& state, float amplitude, bool masked) {
  const auto width = static_cast<int>(state.range(0));
  const auto height = static_cast<int>(state.range(1));
  std::vector<ImagePyramid> images;
  for (unsigned i = 0; i < kImages; ++i) images.push_back(textured(width, height, amplitude, i));
  ImageU8 mask(width, height);
  mask.fill(255);
  for (int x = 0; x < width; ++x) mask.at(x, 0) = 0;
  PixelSelector selector;
  std::vector<SelectedPixel> pixels;
  std::size_t next = 0;
  for ([[maybe_unused]] const auto _ : state) {
    selector.select(images[next++ % kImages], masked ? &mask : nullptr, kWanted, &pixels);
    benchmark::DoNotOptimize(pixels.data());
  }
  state.counters["pixels"] = static_cast<double>(pixels.size());
  state.counters["threshold_share"] = selector.threshold_share();
}
void sizes(benchmark::internal::Benchmark* one) {
  one->Args({752, 480})->Args({1392, 512})->Unit(benchmark::kMicrosecond);
}
BENCHMARK_CAPTURE(select, plain, 80.0F, false)->Apply(sizes);
BENCHMARK_CAPTURE(select, masked, 80.0F, true)->Apply(sizes);
BENCHMARK_CAPTURE(select, weak, 6.0F, true)->Apply(sizes);

}  // namespace
}  // namespace sovo
