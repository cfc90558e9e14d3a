#include "sovo/geometry/lens_change.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace sovo {

CameraModel with_changed_numbers(const CameraModel& camera, const LensChange& numbers) {
  CameraModel out = camera;
  const double factor = std::exp(numbers.focal);
  out.fx *= factor;
  out.fy *= factor;
  if (numbers.radial == 0.0) return out;
  if (out.distortion == Distortion::kNone) {
    out.distortion = Distortion::kRadtan;
    out.num_coefficients = 4;
  }
  out.d[0] += numbers.radial;
  return out;
}

Mat2 change_of_rays(const CameraModel& camera) {
  constexpr double kSmall = 1e-5;
  constexpr int kSteps = 16;
  const std::array<CameraModel, 2> changed = {with_changed_numbers(camera, {kSmall, 0.0}),
                                              with_changed_numbers(camera, {0.0, kSmall})};
  Mat2 H = Mat2::Zero();
  Mat2 right = Mat2::Zero();
  for (int i = 0; i < kSteps * kSteps; ++i) {
    const Vec2 pixel((i % kSteps + 0.5) / kSteps * camera.width - 0.5,
                     (i / kSteps + 0.5) / kSteps * camera.height - 0.5);
    const auto ray = camera.unproject(pixel);
    const std::array<std::optional<Vec3>, 2> now = {changed[0].unproject(pixel),
                                                    changed[1].unproject(pixel)};
    if (!ray || !now[0] || !now[1] || ray->z() < 0.1) continue;
    const Vec2 x = ray->head<2>() / ray->z();
    const Vec2 terms = x.norm() * Vec2(1.0, x.squaredNorm());
    H += terms * terms.transpose();
    for (Eigen::Index k = 0; k < 2; ++k) {
      const Vec3& r = *now[static_cast<std::size_t>(k)];
      const double nearer = (x - r.head<2>() / r.z()).dot(x) / std::max(x.norm(), 1e-9) / kSmall;
      right.col(k) += terms * nearer;
    }
  }
  return H.inverse() * right;
}

}  // namespace sovo
