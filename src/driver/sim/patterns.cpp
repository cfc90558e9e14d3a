#include "sovo/driver/sim/patterns.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sovo/driver/sim/canvas.h"
#include "sovo/driver/sim/noise.h"
#include "sovo/driver/sim/random.h"

namespace sovo::sim {
namespace {

/// Many short lines of any direction.
void add_scratches(Canvas* canvas, int count, double length, float low, float high,
                   Random* random) {
  const double texel = 1.0 / canvas->size();
  for (int i = 0; i < count; ++i) {
    const double x = random->uniform();
    const double y = random->uniform();
    const double angle = random->uniform(0.0, 2.0 * std::numbers::pi);
    const double l = length * random->uniform(0.3, 1.0);
    const float v = random->uniform_float(low, high);
    canvas->stroke(
        {x, y, x + l * std::cos(angle), y + l * std::sin(angle), 1.5 * texel, 0.7 * texel, v, v});
  }
}

/// Many small discs.
void add_grains(Canvas* canvas, int count, double radius, float low, float high, Random* random) {
  for (int i = 0; i < count; ++i) {
    const double r = radius * random->uniform(0.4, 1.0);
    canvas->ellipse(random->uniform(), random->uniform(), r, r * random->uniform(0.6, 1.0),
                    random->uniform(0.0, 3.0), random->uniform_float(low, high), 0.8F);
  }
}

/// A window with frame, panes that mirror something, and a sill.
void add_window(Canvas* canvas, double x0, double y0, double x1, double y1, int panes,
                Random* random) {
  const double frame = 0.012;
  canvas->rectangle(x0 - frame, y0 - frame, x1 + frame, y1 + frame, 0.82F);
  canvas->rectangle(x0, y0, x1, y1, 0.10F);
  const double width = (x1 - x0) / panes;
  for (int i = 0; i < panes; ++i) {
    const double left = x0 + i * width + 0.004;
    const double right = x0 + (i + 1) * width - 0.004;
    const float glass = random->uniform_float(0.06, 0.3);
    canvas->rectangle(left, y0 + 0.004, right, y1 - 0.004, glass);
    const double curtain = y0 + (y1 - y0) * random->uniform(0.15, 0.7);
    canvas->rectangle(left, y0 + 0.004, right, curtain, random->uniform_float(0.25, 0.6), 0.7F);
    for (double x = left + 0.006; x < right; x += 0.012) {
      canvas->rectangle(x, y0 + 0.004, x + 0.004, curtain, random->uniform_float(0.15, 0.5), 0.5F);
    }
    canvas->rectangle(right, y0, right + 0.008, y1, 0.78F);
  }
  canvas->rectangle(x0, y0 + 0.3 * (y1 - y0), x1, y0 + 0.3 * (y1 - y0) + 0.007, 0.78F);
  canvas->rectangle(x0 - 0.025, y1 + frame, x1 + 0.025, y1 + frame + 0.016, 0.7F);
  canvas->rectangle(x0 - 0.025, y1 + frame + 0.016, x1 + 0.025, y1 + frame + 0.03, 0.15F, 0.6F);
}

}  // namespace

ImageF grass_pattern(int size, std::uint64_t seed) {
  Random random(seed);
  Canvas canvas(size, 0.10F);
  canvas.add_noise(8, 7, 0.8F, 0.12F, seed);
  const int blades = size * size / 28;
  for (int i = 0; i < blades; ++i) {
    const double x = random.uniform();
    const double y = random.uniform();
    const double angle = random.uniform(0.0, 2.0 * std::numbers::pi);
    const double length = random.uniform(0.008, 0.03);
    const double bend = random.uniform(-0.6, 0.6);
    // Blades drawn later lie higher and get more light.
    const double height = 0.25 + 0.75 * i / blades;
    const auto tone = static_cast<float>(height * random.uniform(0.25, 0.75));
    const double width = random.uniform(0.0012, 0.0032);
    const double mx = x + 0.5 * length * std::cos(angle);
    const double my = y + 0.5 * length * std::sin(angle);
    canvas.stroke({x, y, mx, my, width, width, 0.5F * tone, tone});
    canvas.stroke({mx, my, mx + 0.5 * length * std::cos(angle + bend),
                   my + 0.5 * length * std::sin(angle + bend), width, 0.3 * width, tone,
                   1.15F * tone});
  }
  return canvas.image();
}

ImageF asphalt_pattern(int size, std::uint64_t seed) {
  Random random(seed);
  Canvas canvas(size, 0.42F);
  canvas.add_noise(4, 8, 0.85F, 0.5F, seed);
  add_grains(&canvas, size * 12, 2.2 / size, 0.15F, 0.85F, &random);
  add_scratches(&canvas, 10, 0.4, 0.12F, 0.25F, &random);
  return canvas.image();
}

ImageF paving_pattern(int size, int slabs, std::uint64_t seed) {
  Random random(seed);
  Canvas canvas(size, 0.2F);
  const double cell = 1.0 / slabs;
  for (int j = 0; j < slabs; ++j) {
    for (int i = 0; i < slabs; ++i) {
      const double gap = 0.035 * cell;
      canvas.rectangle(i * cell + gap, j * cell + gap, (i + 1) * cell - gap, (j + 1) * cell - gap,
                       random.uniform_float(0.4, 0.66));
    }
  }
  add_grains(&canvas, size * 6, 3.0 / size, 0.25F, 0.75F, &random);
  canvas.add_noise(8, 7, 0.8F, 0.35F, seed);
  return canvas.image();
}

ImageF brick_pattern(int size, int rows, std::uint64_t seed) {
  Random random(seed);
  Canvas canvas(size, 0.55F);
  const double height = 1.0 / rows;
  const double width = 2.0 * height;
  for (int j = 0; j < rows; ++j) {
    const double shift = j % 2 == 0 ? 0.0 : 0.5 * width;
    for (int i = 0; i < rows / 2; ++i) {
      const double x = i * width + shift;
      const double y = j * height;
      canvas.rectangle(x + 0.08 * height, y + 0.08 * height, x + width - 0.08 * height,
                       y + 0.92 * height, random.uniform_float(0.2, 0.5));
    }
  }
  canvas.add_noise(16, 6, 0.8F, 0.25F, seed);
  return canvas.image();
}

ImageF tile_pattern(int size, int tiles, std::uint64_t seed) {
  Random random(seed);
  Canvas canvas(size, 0.28F);
  const double cell = 1.0 / tiles;
  for (int j = 0; j < tiles; ++j) {
    for (int i = 0; i < tiles; ++i) {
      const double gap = 0.05 * cell;
      canvas.rectangle(i * cell + gap, j * cell + gap, (i + 1) * cell - gap, (j + 1) * cell - gap,
                       random.uniform_float(0.55, 0.8));
    }
  }
  add_scratches(&canvas, size / 2, 0.02, 0.3F, 0.9F, &random);
  add_grains(&canvas, size, 2.5 / size, 0.25F, 0.6F, &random);
  canvas.add_noise(4, 8, 0.75F, 0.22F, seed);
  return canvas.image();
}

ImageF facade_pattern(int size, int style, std::uint64_t seed) {
  Random random(seed);
  const bool bricks = style % 3 == 1;
  Canvas canvas(bricks ? brick_pattern(size, 32, seed) : Canvas(size, 0.5F).image());
  if (!bricks) {
    canvas.image().fill(random.uniform_float(0.4, 0.7));
    canvas.add_noise(8, 7, 0.85F, 0.3F, seed);
    add_grains(&canvas, size * 4, 1.6 / size, 0.3F, 0.8F, &random);
  }
  const double width = style % 2 == 0 ? 0.24 : 0.32;
  const double top = style % 4 == 3 ? 0.12 : 0.24;
  const double bottom = style % 4 == 2 ? 0.92 : 0.76;
  for (const double centre : {0.25, 0.75}) {
    add_window(&canvas, centre - 0.5 * width, top, centre + 0.5 * width, bottom,
               style % 2 == 0 ? 2 : 3, &random);
    if (style % 4 == 0) {  // shutters
      for (const double x : {centre - 0.5 * width - 0.07, centre + 0.5 * width + 0.01}) {
        canvas.rectangle(x, top, x + 0.06, bottom, 0.2F);
        for (double y = top + 0.01; y < bottom; y += 0.02) {
          canvas.rectangle(x + 0.006, y, x + 0.054, y + 0.01, 0.32F);
        }
      }
    }
  }
  canvas.rectangle(0.0, 0.97, 1.0, 1.0, bricks ? 0.6F : 0.3F);  // a ledge below every storey
  canvas.add_noise(2, 7, 0.7F, 0.12F, seed + 1);
  return canvas.image();
}

ImageF concrete_pattern(int size, std::uint64_t seed) {
  Random random(seed);
  Canvas canvas(size, 0.5F);
  canvas.add_noise(4, 9, 0.82F, 0.6F, seed);
  for (int i = 0; i < 30; ++i) {
    const double r = random.uniform(0.005, 0.05);
    canvas.ellipse(random.uniform(), random.uniform(), r, r * random.uniform(0.3, 1.0),
                   random.uniform(0.0, 3.0), random.uniform_float(0.15, 0.75), 0.35F);
  }
  add_scratches(&canvas, 120, 0.08, 0.15F, 0.8F, &random);
  add_grains(&canvas, size * 3, 2.0 / size, 0.2F, 0.8F, &random);
  return canvas.image();
}

ImageF crate_pattern(int size, std::uint64_t seed) {
  Random random(seed);
  Canvas canvas(size, 0.12F);
  const int boards = 6;
  const auto board = [&](double x0, double y0, double x1, double y1, bool upright) {
    const float tone = random.uniform_float(0.38, 0.65);
    canvas.rectangle(x0, y0, x1, y1, tone);
    for (int i = 0; i < 14; ++i) {  // grain of the wood
      const double p = random.uniform();
      const double q = random.uniform(-0.004, 0.004);
      const float dark = tone * random.uniform_float(0.5, 1.15);
      const double x = x0 + p * (x1 - x0);
      const double y = y0 + p * (y1 - y0);
      if (upright) canvas.stroke({x, y0, x + q, y1, 0.003, 0.002, dark, tone});
      if (!upright) canvas.stroke({x0, y, x1, y + q, 0.003, 0.002, dark, tone});
    }
  };
  for (int i = 0; i < boards; ++i) {
    board(0.01, (i + 0.06) / boards, 0.99, (i + 0.94) / boards, false);
  }
  board(0.01, 0.01, 0.13, 0.99, true);
  board(0.87, 0.01, 0.99, 0.99, true);
  for (const double x : {0.07, 0.93}) {
    for (int i = 0; i < boards; ++i) canvas.ellipse(x, (i + 0.5) / boards, 0.008, 0.008, 0, 0.1F);
  }
  for (int i = 0; i < 9; ++i) {  // stencilled letters
    const double x = 0.25 + 0.055 * i;
    canvas.rectangle(x, 0.42, x + 0.012, 0.55, 0.08F, 0.8F);
    canvas.rectangle(x, 0.42 + 0.1 * random.uniform(), x + 0.035, 0.55, 0.08F, 0.7F);
  }
  canvas.add_noise(8, 7, 0.85F, 0.3F, seed);
  return canvas.image();
}

ImageF car_pattern(int size, std::uint64_t seed) {
  Random random(seed);
  const float paint = random.chance(0.4) ? 0.75F : random.uniform_float(0.12, 0.4);
  Canvas canvas(size, paint);
  canvas.rectangle(0.0, 0.0, 1.0, 0.1, 0.8F * paint + 0.15F);
  canvas.rectangle(0.0, 0.55, 1.0, 0.62, 0.5F * paint);
  for (const double x : {0.33, 0.52, 0.7}) canvas.rectangle(x, 0.05, x + 0.006, 0.8, 0.05F);
  for (const double x : {0.36, 0.55}) canvas.rectangle(x, 0.25, x + 0.05, 0.3, 0.6F);
  canvas.rectangle(0.0, 0.15, 0.04, 0.35, 0.3F);
  canvas.rectangle(0.95, 0.2, 1.0, 0.38, 0.95F);
  canvas.rectangle(0.0, 0.8, 1.0, 1.0, 0.06F);
  for (const double x : {0.2, 0.8}) {
    canvas.ellipse(x, 0.78, 0.1, 0.42, 0.0, 0.04F);
    canvas.ellipse(x, 0.8, 0.05, 0.2, 0.0, 0.55F);
    for (int i = 0; i < 5; ++i) {
      const double a = 1.2566 * i;
      canvas.ellipse(x + 0.028 * std::cos(a), 0.8 + 0.11 * std::sin(a), 0.008, 0.04, 0.0, 0.1F);
    }
  }
  canvas.add_noise(4, 7, 0.8F, 0.12F, seed);
  return canvas.image();
}

ImageF cloud_pattern(int size, std::uint64_t seed) {
  ImageF image = noise_pattern(size, 4, 7, 0.55F, seed);
  for (std::size_t i = 0; i < image.size(); ++i) {
    const float t = std::clamp((image.data()[i] - 0.45F) / 0.3F, 0.0F, 1.0F);
    image.data()[i] = t * t * (3.0F - 2.0F * t);
  }
  return image;
}

}  // namespace sovo::sim
