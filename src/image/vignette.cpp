#include "sovo/image/vignette.h"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <optional>

#include "sovo/image/lanes.h"

namespace sovo {

namespace {

/// 1 / V = exp(x), x = -log V from 0 to 2, within 1e-4 of it: the series of exp(x / 4), squared
/// twice.
template <class F>
SOVO_LANE_FUNCTION F gain_at(const F& s, const std::array<float, 3>& terms) {
  const F x = -0.25F * s * (terms[0] + s * (terms[1] + s * terms[2]));
  const F root =
      1.0F +
      x * (1.0F + x * (1.0F / 2.0F + x * (1.0F / 6.0F + x * (1.0F / 24.0F + x * (1.0F / 120.0F)))));
  const F square = root * root;
  return square * square;
}

struct DivideByVignette {
  template <class F>
  SOVO_LANE_FUNCTION static void run(const ImageF& off_axis, const std::array<float, 3>& terms,
                                     ImageF* image) {
    constexpr std::size_t n = lanes_of<F>;
    const std::size_t whole = image->size() / n * n;
    const float* s = off_axis.data();
    float* grey = image->data();
    for (std::size_t i = 0; i < whole; i += n) {
      store_lane(F(load_lane<F>(grey + i) * gain_at(load_lane<F>(s + i), terms)), grey + i);
    }
    std::array<float, n> last_s{};
    std::array<float, n> last_grey{};
    const std::size_t rest = image->size() - whole;
    std::copy_n(s + whole, rest, last_s.begin());
    std::copy_n(grey + whole, rest, last_grey.begin());
    store_lane(F(load_lane<F>(last_grey.data()) * gain_at(load_lane<F>(last_s.data()), terms)),
               last_grey.data());
    std::copy_n(last_grey.begin(), rest, grey + whole);
  }
};

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

void VignetteCorrection::apply(const RadialVignette& vignette, ImageF* image) const {
  assert(image->width() == off_axis_.width() && image->height() == off_axis_.height());
  std::array<float, 3> terms{};
  std::ranges::transform(vignette.terms, terms.begin(),
                         [](double c) { return static_cast<float>(c); });
  run_kernel<DivideByVignette>(off_axis_, terms, image);
}

}  // namespace sovo
