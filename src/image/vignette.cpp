#include "sovo/image/vignette.h"

#include <cmath>
#include <cstddef>
#include <optional>

namespace sovo {

namespace {

/// 1 / V by s, between whose values it is linear: an exponential a pixel would take a frame's time.
constexpr int kTableSteps = 512;
using GainTable = std::array<float, kTableSteps + 2>;

GainTable gain_table(const RadialVignette& vignette) {
  GainTable table{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    table[i] = static_cast<float>(
        std::exp(-vignette.log_at(static_cast<double>(i) / static_cast<double>(kTableSteps))));
  }
  return table;
}

void set_gains(const GainTable& table, const ImageF& off_axis, ImageF* gains) {
  gains->resize(off_axis.width(), off_axis.height());
  for (std::size_t i = 0; i < off_axis.size(); ++i) {
    const float at = off_axis.data()[i] * static_cast<float>(kTableSteps);
    const auto cell = static_cast<std::size_t>(at);
    const float within = at - static_cast<float>(cell);
    gains->data()[i] = table[cell] + within * (table[cell + 1] - table[cell]);
  }
}

}  // namespace

OffAxis::OffAxis(const CameraModel& pinhole) {
  const double x = std::max(pinhole.cx, pinhole.width - 1 - pinhole.cx) / pinhole.fx;
  const double y = std::max(pinhole.cy, pinhole.height - 1 - pinhole.cy) / pinhole.fy;
  farthest_ = sin2(x * x + y * y);
}

ImageF OffAxis::of(const CameraModel& camera) const {
  ImageF out;
  out.resize(camera.width, camera.height);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const std::optional<Vec3> ray = camera.unproject(Vec2(x, y));
      out.at(x, y) = ray ? static_cast<float>(of(ray->x() / ray->z(), ray->y() / ray->z())) : 1.0F;
    }
  }
  return out;
}

void VignetteCorrection::set(const RadialVignette& vignette, const ImageF& left,
                             const ImageF& right) {
  vignette_ = vignette;
  const GainTable table = gain_table(vignette);
  set_gains(table, left, &left_);
  set_gains(table, right, &right_);
}

void VignetteCorrection::multiply(const ImageF& gains, ImageF* image) {
  for (std::size_t i = 0; i < gains.size(); ++i) image->data()[i] *= gains.data()[i];
}

}  // namespace sovo
