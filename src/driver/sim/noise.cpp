#include "sovo/driver/sim/noise.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "sovo/driver/sim/random.h"

namespace sovo::sim {
namespace {

float lattice_value(int x, int y, std::uint64_t seed) {
  const auto cell = static_cast<std::uint64_t>(y) << 32 | static_cast<std::uint64_t>(x);
  return static_cast<float>(unit(combine(seed, cell))) - 0.5F;
}

float fade(float t) { return t * t * t * (t * (t * 6.0F - 15.0F) + 10.0F); }

/// Adds one octave of `cells` x `cells` values; returns nothing beyond [-amplitude, amplitude] / 2.
void add_octave(ImageF* image, int cells, float amplitude, std::uint64_t seed) {
  const int size = image->width();
  std::vector<float> values(static_cast<std::size_t>(cells) * cells);
  for (int y = 0; y < cells; ++y) {
    for (int x = 0; x < cells; ++x) {
      values[static_cast<std::size_t>(y) * cells + x] = lattice_value(x, y, seed);
    }
  }
  const float step = static_cast<float>(cells) / static_cast<float>(size);
  for (int y = 0; y < size; ++y) {
    const float fy = static_cast<float>(y) * step;
    const int y0 = static_cast<int>(fy);
    const float wy = fade(fy - static_cast<float>(y0));
    const float* upper = &values[static_cast<std::size_t>(y0) * cells];
    const float* lower = &values[static_cast<std::size_t>((y0 + 1) % cells) * cells];
    for (int x = 0; x < size; ++x) {
      const float fx = static_cast<float>(x) * step;
      const int x0 = static_cast<int>(fx);
      const int x1 = (x0 + 1) % cells;
      const float wx = fade(fx - static_cast<float>(x0));
      const float a = upper[x0] + wx * (upper[x1] - upper[x0]);
      const float b = lower[x0] + wx * (lower[x1] - lower[x0]);
      image->at(x, y) += amplitude * (a + wy * (b - a));
    }
  }
}

}  // namespace

ImageF noise_pattern(int size, int cells, int octaves, float persistence, std::uint64_t seed) {
  ImageF image(size, size);
  image.fill(0.0F);
  float amplitude = 1.0F;
  float variance = 0.0F;
  for (int i = 0; i < octaves && cells <= size; ++i) {
    add_octave(&image, cells, amplitude, combine(seed, static_cast<std::uint64_t>(i)));
    variance += amplitude * amplitude;
    amplitude *= persistence;
    cells *= 2;
  }
  // One octave's standard deviation is about 0.2.
  const float normalize = 1.0F / std::sqrt(variance);
  for (std::size_t i = 0; i < image.size(); ++i) {
    image.data()[i] = std::clamp(0.5F + normalize * image.data()[i], 0.0F, 1.0F);
  }
  return image;
}

ImageF caustic_pattern(int size, int points, std::uint64_t seed) {
  // One point in each cell of a grid, so that the nearest two lie in the cells around.
  const int grid = std::max(2, static_cast<int>(std::lround(std::sqrt(points))));
  std::vector<double> px(static_cast<std::size_t>(grid) * grid);
  std::vector<double> py(px.size());
  Random random(seed);
  for (std::size_t i = 0; i < px.size(); ++i) {
    px[i] = random.uniform(0.1, 0.9);
    py[i] = random.uniform(0.1, 0.9);
  }
  ImageF image(size, size);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const double gx = (x + 0.5) / size * grid;
      const double gy = (y + 0.5) / size * grid;
      double nearest = 9.0;
      double second = 9.0;
      for (int j = static_cast<int>(gy) - 2; j <= static_cast<int>(gy) + 2; ++j) {
        for (int i = static_cast<int>(gx) - 2; i <= static_cast<int>(gx) + 2; ++i) {
          const auto k = static_cast<std::size_t>((j + grid) % grid) * grid + (i + grid) % grid;
          const double d = std::hypot(i + px[k] - gx, j + py[k] - gy);
          second = std::min(second, std::max(nearest, d));
          nearest = std::min(nearest, d);
        }
      }
      const double edge = std::clamp((second - nearest) / 0.55, 0.0, 1.0);
      image.at(x, y) = static_cast<float>((1.0 - edge) * (1.0 - edge));
    }
  }
  return image;
}

}  // namespace sovo::sim
