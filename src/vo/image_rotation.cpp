#include "sovo/vo/image_rotation.h"

#include <cmath>
#include <limits>

#include "sovo/geometry/linear_solvers.h"
#include "sovo/image/interpolation.h"
#include "sovo/vo/motion_hypotheses.h"

namespace sovo {

namespace {

/// Correlation of the pixels of `from` with where a rotation puts them in `to`; -1 when fewer than
/// half of them come to lie there.
double correlation_under(const ImageF& from, const ImageF& to, const CameraModel& camera,
                         const SO3& R_to_from) {
  constexpr int kStride = 2;  // of pixels that are looked at, in either direction
  const Mat3 R = R_to_from.matrix();
  double n = 0.0, a = 0.0, b = 0.0, aa = 0.0, bb = 0.0, ab = 0.0;
  int all = 0;
  for (int y = 1; y < from.height(); y += kStride) {
    for (int x = 1; x < from.width(); x += kStride) {
      ++all;
      const Vec3 p = R * Vec3((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1.0);
      if (p.z() < 0.1) continue;
      const auto u = static_cast<float>(camera.fx * p.x() / p.z() + camera.cx);
      const auto v = static_cast<float>(camera.fy * p.y() / p.z() + camera.cy);
      if (!in_image(to, u, v)) continue;
      const double s = from.at(x, y);
      const double t = sample(to, u, v);
      n += 1.0;
      a += s;
      b += t;
      aa += s * s;
      bb += t * t;
      ab += s * t;
    }
  }
  if (2.0 * n < all) return -1.0;
  const double va = aa - a * a / n;
  const double vb = bb - b * b / n;
  return va > 0.0 && vb > 0.0 ? (ab - a * b / n) / std::sqrt(va * vb) : -1.0;
}

}  // namespace

double align_rotation(const ImageF& from, const ImageF& to, const CameraModel& camera,
                      const SO3& start, SO3* R_to_from) {
  using Vec5 = Eigen::Matrix<double, 5, 1>;
  using Mat5 = Eigen::Matrix<double, 5, 5>;
  constexpr int kIterations = 12;
  constexpr double kHuber = 15.0;
  SO3 R = start;
  double a = 1.0, b = 0.0, rms = std::numeric_limits<double>::infinity();
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const Mat3 r = R.matrix();
    Mat5 H = Mat5::Zero();
    Vec5 g = Vec5::Zero();
    double energy = 0.0, weight_sum = 0.0;
    int count = 0;
    for (int y = 0; y < from.height(); ++y) {
      for (int x = 0; x < from.width(); ++x) {
        const Vec3 p = r * Vec3((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1.0);
        if (p.z() < 0.1) continue;
        const double px = p.x() / p.z(), py = p.y() / p.z();
        const float u = static_cast<float>(camera.fx * px + camera.cx);
        const float v = static_cast<float>(camera.fy * py + camera.cy);
        if (!in_image(to, u, v)) continue;
        const Sample s = sample_with_gradient(to, u, v);
        const double residual = s.value - a * from.at(x, y) - b;
        const double w = std::min(1.0, kHuber / std::max(std::abs(residual), 1e-9));
        const double gx = s.gx * camera.fx, gy = s.gy * camera.fy;
        Vec5 J;
        J << -gx * px * py - gy * (1.0 + py * py), gx * (1.0 + px * px) + gy * px * py,
            -gx * py + gy * px, -from.at(x, y), -1.0;
        H.selfadjointView<Eigen::Lower>().rankUpdate(J, w);
        g += w * residual * J;
        energy += w * residual * residual;
        weight_sum += w;
        ++count;
      }
    }
    if (2 * count < from.width() * from.height()) return std::numeric_limits<double>::infinity();
    rms = std::sqrt(energy / weight_sum);
    *R_to_from = R;
    H.diagonal() += Vec5::Constant(1e-6);
    const Vec5 step = -solve_small(H, g);
    R = SO3::exp(step.head<3>()) * R;
    a += step[3];
    b += step[4];
    if (step.head<3>().norm() < 0.02 / camera.fx) break;
  }
  return rms;
}

std::optional<SO3> search_rotation(const ImageF& from, const ImageF& to, const CameraModel& camera,
                                   const SO3& around, double reach) {
  constexpr double kLeastCorrelation = 0.3;
  double best = kLeastCorrelation;
  std::optional<SO3> start;
  for (const SO3& turn : turns(reach, camera)) {
    const double correlation = correlation_under(from, to, camera, turn * around);
    if (correlation <= best) continue;
    best = correlation;
    start = turn * around;
  }
  if (!start) return std::nullopt;
  SO3 found = *start;
  return std::isfinite(align_rotation(from, to, camera, *start, &found)) ? found : *start;
}

}  // namespace sovo
