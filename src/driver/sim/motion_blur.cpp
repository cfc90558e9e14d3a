#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "sovo/driver/sim/sensor.h"

namespace sovo::sim {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

/// Way of what a pixel shows over the image during the exposure [px].
Vector2f flow_of(const RayTable& rays, int x, int y, float range, const Vector3f& shift,
                 const Vector3f& turn) {
  const Vector3f ray = rays.ray(x, y);
  // A point at rest: d ray = -(turn x ray) - (shift - ray (ray . shift)) / range.
  Vector3f change = -turn.cross(ray);
  if (std::isfinite(range)) change -= (shift - ray * ray.dot(shift)) / range;
  const RayTable::PixelStep& step = rays.pixel_step(x, y);
  const auto along = [&change](const std::array<float, 3>& row) {
    return row[0] * change.x() + row[1] * change.y() + row[2] * change.z();
  };
  return {along(step.x), along(step.y)};
}

float sample(const ImageF& image, float x, float y) {
  x = std::clamp(x, 0.0F, static_cast<float>(image.width() - 1));
  y = std::clamp(y, 0.0F, static_cast<float>(image.height() - 1));
  const int x0 = std::min(static_cast<int>(x), image.width() - 2);
  const int y0 = std::min(static_cast<int>(y), image.height() - 2);
  const float fx = x - static_cast<float>(x0);
  const float fy = y - static_cast<float>(y0);
  const float* upper = image.row(y0) + x0;
  const float* lower = image.row(y0 + 1) + x0;
  const float top = upper[0] + fx * (upper[1] - upper[0]);
  return top + fy * (lower[0] + fx * (lower[1] - lower[0]) - top);
}

}  // namespace

void blur_by_motion(const RayTable& rays, const RenderedImage& image, const Vec6& velocity,
                    double exposure_s, ImageF* blurred) {
  constexpr float kVisible = 0.5F;  // [px]; less takes a few hundredths of the finest detail
  constexpr int kMostTaps = 33;
  const ImageF& light = image.light;
  blurred->resize(light.width(), light.height());
  const Vector3f shift = (exposure_s * velocity.head<3>()).cast<float>();
  const Vector3f turn = (exposure_s * velocity.tail<3>()).cast<float>();
  for (int y = 0; y < light.height(); ++y) {
    for (int x = 0; x < light.width(); ++x) {
      const Vector2f flow = flow_of(rays, x, y, image.range.at(x, y), shift, turn);
      const float length = flow.norm();
      if (!(length > kVisible)) {
        blurred->at(x, y) = light.at(x, y);
        continue;
      }
      const int taps = std::min(kMostTaps, static_cast<int>(std::ceil(length)) + 1);
      float sum = 0.0F;
      for (int i = 0; i < taps; ++i) {
        const float at = (static_cast<float>(i) + 0.5F) / static_cast<float>(taps) - 0.5F;
        sum += sample(light, static_cast<float>(x) + at * flow.x(),
                      static_cast<float>(y) + at * flow.y());
      }
      blurred->at(x, y) = sum / static_cast<float>(taps);
    }
  }
}

}  // namespace sovo::sim
