#include "sovo/driver/sim/canvas.h"

#include <algorithm>
#include <cmath>

#include "sovo/driver/sim/noise.h"

namespace sovo::sim {

Canvas::Canvas(int size, float value) : image_(size, size) { image_.fill(value); }

void Canvas::blend(int x, int y, float value, float opacity) {
  const int mask = size() - 1;
  float& texel = image_.at(x & mask, y & mask);
  texel += opacity * (value - texel);
}

void Canvas::rectangle(double x0, double y0, double x1, double y1, float value, float opacity) {
  const double s = size();
  const auto cover = [s](int i, double low, double high) {
    return std::clamp(std::min(high * s, i + 1.0) - std::max(low * s, i + 0.0), 0.0, 1.0);
  };
  for (int y = static_cast<int>(std::floor(y0 * s)); y < y1 * s; ++y) {
    const double row = cover(y, y0, y1);
    for (int x = static_cast<int>(std::floor(x0 * s)); x < x1 * s; ++x) {
      blend(x, y, value, opacity * static_cast<float>(row * cover(x, x0, x1)));
    }
  }
}

void Canvas::stroke(const Stroke& k) {
  const double s = size();
  const double margin = 0.5 * std::max(k.w0, k.w1) * s + 1.0;
  const double dx = (k.x1 - k.x0) * s;
  const double dy = (k.y1 - k.y0) * s;
  const double length_squared = std::max(1e-12, dx * dx + dy * dy);
  const int left = static_cast<int>(std::floor(std::min(k.x0, k.x1) * s - margin));
  const int right = static_cast<int>(std::ceil(std::max(k.x0, k.x1) * s + margin));
  const int top = static_cast<int>(std::floor(std::min(k.y0, k.y1) * s - margin));
  const int bottom = static_cast<int>(std::ceil(std::max(k.y0, k.y1) * s + margin));
  for (int y = top; y <= bottom; ++y) {
    for (int x = left; x <= right; ++x) {
      const double px = x + 0.5 - k.x0 * s;
      const double py = y + 0.5 - k.y0 * s;
      const double along = std::clamp((px * dx + py * dy) / length_squared, 0.0, 1.0);
      const double ex = px - along * dx;
      const double ey = py - along * dy;
      const double distance = std::sqrt(ex * ex + ey * ey);
      const double half = 0.5 * s * (k.w0 + along * (k.w1 - k.w0));
      const double opacity = std::clamp(half - distance + 0.5, 0.0, 1.0);
      if (opacity <= 0.0) continue;
      blend(x, y, k.v0 + static_cast<float>(along) * (k.v1 - k.v0), static_cast<float>(opacity));
    }
  }
}

void Canvas::ellipse(double x, double y, double a, double b, double angle, float value,
                     float opacity) {
  const double s = size();
  const double reach = std::max(a, b) * s + 1.0;
  const double c = std::cos(angle);
  const double n = std::sin(angle);
  for (int j = static_cast<int>(std::floor(y * s - reach)); j <= y * s + reach; ++j) {
    for (int i = static_cast<int>(std::floor(x * s - reach)); i <= x * s + reach; ++i) {
      const double px = i + 0.5 - x * s;
      const double py = j + 0.5 - y * s;
      const double r = std::hypot((c * px + n * py) / (a * s), (c * py - n * px) / (b * s));
      // Distance to the edge in texels, near enough for a smooth one.
      const double edge = (1.0 - r) * std::min(a, b) * s + 0.5;
      if (edge > 0.0) blend(i, j, value, opacity * static_cast<float>(std::min(1.0, edge)));
    }
  }
}

void Canvas::add_noise(int cells, int octaves, float persistence, float amplitude,
                       std::uint64_t seed) {
  const ImageF noise = noise_pattern(size(), cells, octaves, persistence, seed);
  for (std::size_t i = 0; i < noise.size(); ++i) {
    image_.data()[i] += amplitude * (noise.data()[i] - 0.5F);
  }
}

}  // namespace sovo::sim
