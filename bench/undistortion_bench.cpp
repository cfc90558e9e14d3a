// Time of the undistortion of a frame of 752x480: from bytes, and by way of floats.

#include <benchmark/benchmark.h>

#include <memory>
#include <random>
#include <vector>

#include "sovo/image/photometric.h"
#include "sovo/image/undistorter.h"
#include "support/cameras.h"

namespace sovo {
namespace {

/// Frames in turn, so that none is in the cache, as none is that a camera has just delivered.
constexpr std::size_t kFrames = 64;

std::vector<SideImage> frames(const CameraModel& camera) {
  std::mt19937 random(1);
  std::vector<SideImage> out(kFrames);
  for (SideImage& frame : out) {
    std::vector<std::uint8_t> pixels(static_cast<std::size_t>(camera.width * camera.height));
    for (std::uint8_t& pixel : pixels) pixel = static_cast<std::uint8_t>(random() % 256U);
    frame.valid = true;
    frame.width = frame.step = camera.width;
    frame.height = camera.height;
    frame.data = std::make_shared<const std::vector<std::uint8_t>>(std::move(pixels));
  }
  return out;
}

void undistort(benchmark::State& state, bool from_bytes) {
  const CameraModel camera = test::euroc_left();
  const Undistorter undistorter(camera, optimal_pinhole(camera, {}));
  const std::vector<SideImage> raw = frames(camera);
  ImageF floats;
  ImageF out;
  std::size_t next = 0;
  for ([[maybe_unused]] const auto _ : state) {
    const SideImage& frame = raw[next++ % kFrames];
    if (from_bytes) {
      undistorter.apply(frame.data->data(), frame.step, &out);
    } else {
      to_float(frame, {}, 1, &floats);
      undistorter.apply(floats, &out);
    }
    benchmark::DoNotOptimize(out.data());
  }
}
BENCHMARK_CAPTURE(undistort, bytes, true)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(undistort, floats, false)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace sovo
