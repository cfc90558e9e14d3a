#include "sovo/image/undistorter.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

#include "sovo/image/lanes.h"

namespace sovo {

namespace {

/// How far the view of a pinhole leaves the raw image at each side [px]; negative inside.
struct Overhang {
  double left = -1e9, right = -1e9, top = -1e9, bottom = -1e9;
  double worst() const { return std::max({left, right, top, bottom}); }
};

void extend(const CameraModel& raw, const Vec3& ray, Overhang* overhang) {
  constexpr double kNowhere = 1e4;  // past the radius where the distortion folds back
  const auto pixel = raw.project(ray);
  const Vec2 p = pixel ? *pixel
                       : Vec2(ray.x() < 0.0 ? -kNowhere : raw.width + kNowhere,
                              ray.y() < 0.0 ? -kNowhere : raw.height + kNowhere);
  overhang->left = std::max(overhang->left, -p.x());
  overhang->right = std::max(overhang->right, p.x() - (raw.width - 1));
  overhang->top = std::max(overhang->top, -p.y());
  overhang->bottom = std::max(overhang->bottom, p.y() - (raw.height - 1));
}

/// Follows the border of the pinhole's image; the distortion is a continuous map, so the inside
/// lies within.
Overhang overhang_of(const CameraModel& raw, const CameraModel& pinhole) {
  constexpr int kSteps = 64;
  Overhang out;
  const auto ray = [&](double u, double v) {
    return Vec3((u - pinhole.cx) / pinhole.fx, (v - pinhole.cy) / pinhole.fy, 1.0);
  };
  const double w = pinhole.width - 1;
  const double h = pinhole.height - 1;
  for (int i = 0; i <= kSteps; ++i) {
    const double s = static_cast<double>(i) / kSteps;
    extend(raw, ray(s * w, 0.0), &out);
    extend(raw, ray(s * w, h), &out);
    extend(raw, ray(0.0, s * h), &out);
    extend(raw, ray(w, s * h), &out);
  }
  return out;
}

double field_of_view(double size, double focal, double center) {
  return std::atan((center + 0.5) / focal) + std::atan((size - 0.5 - center) / focal);
}

/// Moves the principal point until the view is centred in the raw image; whether it then fits.
bool fit_center(const CameraModel& raw, double max_fov, CameraModel* pinhole) {
  constexpr double kMaxOverhang = 0.0;
  pinhole->cx = 0.5 * (pinhole->width - 1);
  pinhole->cy = 0.5 * (pinhole->height - 1);
  if (const auto axis = raw.unproject({0.5 * (raw.width - 1), 0.5 * (raw.height - 1)})) {
    pinhole->cx -= pinhole->fx * axis->x() / axis->z();
    pinhole->cy -= pinhole->fy * axis->y() / axis->z();
  }
  Overhang overhang;
  for (int i = 0; i < 30; ++i) {
    overhang = overhang_of(raw, *pinhole);
    const double dx = 0.5 * (overhang.right - overhang.left);
    const double dy = 0.5 * (overhang.bottom - overhang.top);
    if (std::abs(dx) > 0.5 * pinhole->width || std::abs(dy) > 0.5 * pinhole->height) break;
    if (std::abs(dx) < 1e-3 && std::abs(dy) < 1e-3) break;
    pinhole->cx += dx;
    pinhole->cy += dy;
  }
  return overhang.worst() <= kMaxOverhang &&
         field_of_view(pinhole->width, pinhole->fx, pinhole->cx) <= max_fov &&
         field_of_view(pinhole->height, pinhole->fy, pinhole->cy) <= max_fov;
}

/// Interpolates each pixel of `out` in `raw`; 0 where its offset is negative.
struct Remap {
  template <class F>
  SOVO_LANE_FUNCTION static void run(const ImageF& raw, const std::int32_t* offset, const float* fx,
                                     const float* fy, ImageF* out) {
    constexpr std::size_t n = lanes_of<F>;
    const std::size_t size = out->size();
    for (std::size_t i = 0; i < size; i += n) {
      // The last pixels are computed with some of those before them.
      i = std::min(i, size - n);
      const auto at = load_mask<MaskOf<F>>(offset + i);
      std::int32_t readable[n];
      store_mask(MaskOf<F>(at < 0 ? MaskOf<F>{} : at), readable);
      const F value = blend_lanes(raw.data(), raw.width(), readable, load_lane<F>(fx + i),
                                  load_lane<F>(fy + i));
      store_lane(F(at < 0 ? F{} : value), out->data() + i);
    }
  }
};

}  // namespace

CameraModel optimal_pinhole(const CameraModel& raw, const UndistortionConfig& config) {
  if (raw.is_pinhole()) return raw;
  const double max_fov = config.max_fov_deg * M_PI / 180.0;
  CameraModel pinhole;
  pinhole.width = raw.width;
  pinhole.height = raw.height;
  pinhole.port = raw.port;
  pinhole.straightened = raw.port.has_value();
  // The shortest focal length whose view still fits, by bisection on its logarithm.
  const double focal = std::sqrt(raw.fx * raw.fy);
  double too_wide = std::log(0.1 * focal);
  double fits = std::log(20.0 * focal);
  while (fits - too_wide > 1e-6) {
    const double middle = 0.5 * (fits + too_wide);
    pinhole.fx = pinhole.fy = std::exp(middle);
    (fit_center(raw, max_fov, &pinhole) ? fits : too_wide) = middle;
  }
  pinhole.fx = pinhole.fy = std::exp(fits);
  fit_center(raw, max_fov, &pinhole);
  return pinhole;
}

Undistorter::Undistorter(const CameraModel& raw, const CameraModel& pinhole)
    : width_(pinhole.width),
      height_(pinhole.height),
      raw_width_(raw.width),
      raw_height_(raw.height) {
  assert(pinhole.is_pinhole() && raw.width >= 2 && raw.height >= 2);
  assert(pinhole.width * pinhole.height >= static_cast<int>(kWideLanes));
  identity_ = raw.is_pinhole() && raw.width == pinhole.width && raw.height == pinhole.height &&
              raw.fx == pinhole.fx && raw.fy == pinhole.fy && raw.cx == pinhole.cx &&
              raw.cy == pinhole.cy;
  if (identity_) return;
  const std::size_t size = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  offset_.assign(size, -1);
  fx_.assign(size, 0.0F);
  fy_.assign(size, 0.0F);
  std::vector<Vec2> sources(size, Vec2(-1.0, -1.0));
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + x;
      const Vec3 ray((x - pinhole.cx) / pinhole.fx, (y - pinhole.cy) / pinhole.fy, 1.0);
      const auto source = raw.project(ray);
      if (!source || !raw.contains(*source)) continue;
      const int ix = std::min(static_cast<int>(source->x()), raw.width - 2);
      const int iy = std::min(static_cast<int>(source->y()), raw.height - 2);
      offset_[i] = iy * raw.width + ix;
      fx_[i] = static_cast<float>(source->x() - ix);
      fy_[i] = static_cast<float>(source->y() - iy);
      sources[i] = *source;
    }
  }
  from_bytes_ = ByteRemap::make(width_, height_, raw_width_, raw_height_, sources);
}

void Undistorter::apply(const ImageF& raw, ImageF* out) const {
  assert(raw.width() == raw_width_ && raw.height() == raw_height_ && out != &raw);
  out->resize(width_, height_);
  if (identity_) {
    std::copy_n(raw.data(), raw.size(), out->data());
    return;
  }
  run_kernel<Remap>(raw, offset_.data(), fx_.data(), fy_.data(), out);
}

Vec2 Undistorter::source(int x, int y) const {
  if (identity_) return {x, y};
  const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + x;
  if (offset_[i] < 0) return {-1.0, -1.0};
  return {offset_[i] % raw_width_ + static_cast<double>(fx_[i]),
          offset_[i] / raw_width_ + static_cast<double>(fy_[i])};
}

ImageU8 Undistorter::valid_mask(const ImageU8& raw_mask) const {
  assert(raw_mask.empty() || (raw_mask.width() == raw_width_ && raw_mask.height() == raw_height_));
  ImageU8 mask(width_, height_);
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const Vec2 p = source(x, y);
      bool valid =
          p.x() >= 1.0 && p.y() >= 1.0 && p.x() <= raw_width_ - 2 && p.y() <= raw_height_ - 2;
      if (valid && !raw_mask.empty()) {  // every pixel that the interpolation reads
        const int left = static_cast<int>(p.x());
        const int top = static_cast<int>(p.y());
        const int right = static_cast<int>(std::ceil(p.x()));
        const int bottom = static_cast<int>(std::ceil(p.y()));
        valid = raw_mask.at(left, top) != 0 && raw_mask.at(right, top) != 0 &&
                raw_mask.at(left, bottom) != 0 && raw_mask.at(right, bottom) != 0;
      }
      mask.at(x, y) = valid ? 255 : 0;
    }
  }
  return mask;
}

}  // namespace sovo
