#include <algorithm>
#include <cmath>
#include <numbers>

#include "sovo/driver/sim/canvas.h"
#include "sovo/driver/sim/noise.h"
#include "sovo/driver/sim/patterns.h"
#include "sovo/driver/sim/random.h"

namespace sovo::sim {
namespace {

/// One drawing on both pictures of a cutout.
class CutoutCanvas {
 public:
  CutoutCanvas(int size, float value) : value_(size, value), opacity_(size, 0.0F) {}

  void stroke(const Canvas::Stroke& stroke) {
    value_.stroke(stroke);
    Canvas::Stroke cover = stroke;
    cover.v0 = cover.v1 = 1.0F;
    opacity_.stroke(cover);
  }
  Cutout take() { return {value_.image(), opacity_.image()}; }
  Canvas& value() { return value_; }

 private:
  Canvas value_;
  Canvas opacity_;
};

}  // namespace

Cutout leaf_cutout(int size, int leaves, double leaf_length, std::uint64_t seed) {
  Random random(seed);
  CutoutCanvas canvas(size, 0.25F);
  for (int i = 0; i < leaves; ++i) {
    // Denser in the middle, all within a disc.
    const double r = (0.47 - leaf_length) * std::sqrt(random.uniform());
    const double where = random.uniform(0.0, 2.0 * std::numbers::pi);
    const double angle = random.uniform(0.0, 2.0 * std::numbers::pi);
    const double x = 0.5 + r * std::cos(where);
    const double y = 0.5 + r * std::sin(where);
    const double l = leaf_length * random.uniform(0.5, 1.0);
    const double mx = x + 0.5 * l * std::cos(angle);
    const double my = y + 0.5 * l * std::sin(angle);
    const auto tone = static_cast<float>((0.3 + 0.7 * i / leaves) * random.uniform(0.3, 0.85));
    canvas.stroke({x, y, mx, my, 0.15 * l, 0.5 * l, 0.8F * tone, tone});
    canvas.stroke({mx, my, x + l * std::cos(angle), y + l * std::sin(angle), 0.5 * l, 0.05 * l,
                   tone, 1.1F * tone});
  }
  return canvas.take();
}

Cutout tuft_cutout(int size, int blades, std::uint64_t seed) {
  Random random(seed);
  CutoutCanvas canvas(size, 0.3F);
  for (int i = 0; i < blades; ++i) {
    const double x = 0.5 + random.uniform(-0.25, 0.25);
    const double lean = random.uniform(-0.14, 0.14) + 0.4 * (x - 0.5);
    const double height = random.uniform(0.35, 0.9);
    const auto tone = static_cast<float>((0.4 + 0.6 * i / blades) * random.uniform(0.3, 0.8));
    const double width = random.uniform(0.02, 0.045);
    const double my = 0.99 - 0.6 * height;
    canvas.stroke({x, 0.985, x + 0.5 * lean, my, width, width, 0.4F * tone, tone});
    canvas.stroke(
        {x + 0.5 * lean, my, x + 1.4 * lean, 0.99 - height, width, 0.2 * width, tone, 1.2F * tone});
  }
  return canvas.take();
}

Cutout spot_cutout(int size, double softness, double fray, std::uint64_t seed) {
  Cutout cutout{Canvas(size, 0.0F).image(), noise_pattern(size, 8, 6, 0.7F, seed)};
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const double r = 2.0 * std::hypot((x + 0.5) / size - 0.5, (y + 0.5) / size - 0.5);
      float& opacity = cutout.opacity.at(x, y);
      const double t = (0.97 - r + fray * (opacity - 0.7) * std::min(1.0, 4.0 * (1.0 - r))) /
                       std::max(1e-3, softness);
      const double clamped = r >= 0.98 ? 0.0 : std::clamp(t, 0.0, 1.0);
      opacity = static_cast<float>(clamped * clamped * (3.0 - 2.0 * clamped));
    }
  }
  return cutout;
}

ImageF machine_pattern(int size, std::uint64_t seed) {
  Random random(seed);
  Canvas canvas(size, 0.3F);
  const int cells = 4;
  for (int j = 0; j < cells; ++j) {
    for (int i = 0; i < cells; ++i) {
      const double x = static_cast<double>(i) / cells;
      const double y = static_cast<double>(j) / cells;
      const double s = 1.0 / cells;
      canvas.rectangle(x, y, x + s, y + s, 0.08F);
      canvas.rectangle(x + 0.006, y + 0.006, x + s - 0.006, y + s - 0.006,
                       random.uniform_float(0.3, 0.62));
      for (const double u : {0.08, 0.92}) {
        for (const double v : {0.08, 0.92}) {
          canvas.ellipse(x + u * s, y + v * s, 0.005, 0.005, 0.0, 0.85F);
        }
      }
      const int kind = random.below(4);
      for (int k = 0; k < 7; ++k) {
        const double v = y + s * (0.2 + 0.085 * k);
        if (kind == 0) canvas.rectangle(x + 0.2 * s, v, x + 0.8 * s, v + 0.03 * s, 0.06F);
        if (kind == 1) {
          const double r = s * random.uniform(0.04, 0.12);
          canvas.ellipse(x + s * random.uniform(0.2, 0.8), y + s * random.uniform(0.2, 0.8), r, r,
                         0.0, random.uniform_float(0.05, 0.95));
        }
        if (kind == 2) {
          const double u = x + s * random.uniform(0.15, 0.6);
          canvas.rectangle(u, v, u + s * random.uniform(0.05, 0.3), v + 0.035 * s,
                           random.uniform_float(0.05, 0.9));
        }
      }
    }
  }
  canvas.add_noise(8, 8, 0.85F, 0.28F, seed);
  return canvas.image();
}

}  // namespace sovo::sim
