#include "sovo/geometry/camera_model.h"

#include <Eigen/LU>
#include <cmath>
#include <utility>

namespace sovo {

namespace {

/// A point of the normalized plane after distortion, with d distorted / d undistorted.
struct Distorted {
  Vec2 point;
  Mat2 jacobian;
  bool monotonic;  ///< False past the radius where the model folds back.
};

inline Distorted distort_radtan(const std::array<double, 8>& d, const Vec2& m) {
  const double x = m.x();
  const double y = m.y();
  const double k1 = d[0], k2 = d[1], p1 = d[2], p2 = d[3], k3 = d[4], k4 = d[5], k5 = d[6],
               k6 = d[7];
  const double r2 = x * x + y * y;
  double den = 1.0;
  double g = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  double g_d = k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3);  // dg / d(r^2)
  if (k4 != 0.0 || k5 != 0.0 || k6 != 0.0) {          // few have them, and a division takes long
    den = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6));
    const double den_d = k4 + r2 * (2.0 * k5 + r2 * 3.0 * k6);
    g /= den;
    g_d = (g_d - g * den_d) / den;
  }

  Distorted out;
  out.point = {x * g + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
               y * g + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y};
  out.jacobian << g + 2.0 * x * x * g_d + 2.0 * p1 * y + 6.0 * p2 * x,
      2.0 * x * y * g_d + 2.0 * p1 * x + 2.0 * p2 * y,
      2.0 * x * y * g_d + 2.0 * p1 * x + 2.0 * p2 * y,
      g + 2.0 * y * y * g_d + 6.0 * p1 * y + 2.0 * p2 * x;
  // The distorted radius r * g(r^2) must still grow with r.
  out.monotonic = den > 0.0 && g > 0.0 && g + 2.0 * r2 * g_d > 0.0;
  return out;
}

/// theta_d = theta (1 + k1 theta^2 + ...), and its derivative.
void equidistant_angle(const std::array<double, 8>& d, double theta, double* value,
                       double* derivative) {
  const double t2 = theta * theta;
  *value = theta * (1.0 + t2 * (d[0] + t2 * (d[1] + t2 * (d[2] + t2 * d[3]))));
  *derivative = 1.0 + t2 * (3.0 * d[0] + t2 * (5.0 * d[1] + t2 * (7.0 * d[2] + t2 * 9.0 * d[3])));
}

}  // namespace

std::string to_string(Distortion distortion) {
  switch (distortion) {
    case Distortion::kRadtan:
      return "radtan";
    case Distortion::kEquidistant:
      return "equidistant";
    case Distortion::kNone:
      break;
  }
  return "none";
}

std::optional<Vec2> CameraModel::project(const Vec3& point) const {
  return project(point, nullptr);
}

std::optional<Vec2> CameraModel::project(const Vec3& p, Mat23* jacobian) const {
  if (!port || straightened) return project_in_air(p, jacobian);
  Mat3 refraction;
  const auto air = port->to_air(p, jacobian != nullptr ? &refraction : nullptr);
  if (!air) return std::nullopt;
  const auto pixel = project_in_air(*air, jacobian);
  if (jacobian != nullptr) *jacobian = *jacobian * refraction;
  return pixel;
}

std::optional<Vec2> CameraModel::project_in_air(const Vec3& p, Mat23* jacobian) const {
  if (distortion == Distortion::kEquidistant) {
    const double r = std::hypot(p.x(), p.y());
    const double theta = std::atan2(r, p.z());
    double theta_d = 0.0;
    double slope = 0.0;
    equidistant_angle(d, theta, &theta_d, &slope);
    if (slope <= 0.0 || (r < 1e-12 && p.z() <= 0.0)) return std::nullopt;
    const double n2 = p.squaredNorm();
    const double s = r > 1e-9 ? theta_d / r : 1.0 / p.z();  // m = s * (x, y)
    if (jacobian != nullptr) {
      if (r > 1e-9) {
        const double theta_r = p.z() / n2;  // d theta / d r
        const double s_r = (slope * theta_r * r - theta_d) / (r * r);
        const double s_z = -slope * r / n2 / r;
        const Vec2 u(p.x() / r, p.y() / r);
        *jacobian << fx * (s + p.x() * s_r * u.x()), fx * p.x() * s_r * u.y(), fx * p.x() * s_z,
            fy * p.y() * s_r * u.x(), fy * (s + p.y() * s_r * u.y()), fy * p.y() * s_z;
      } else {
        *jacobian << fx * s, 0, 0, 0, fy * s, 0;
      }
    }
    return Vec2(fx * s * p.x() + cx, fy * s * p.y() + cy);
  }

  if (p.z() <= 1e-9) return std::nullopt;
  const double iz = 1.0 / p.z();
  const Vec2 m(p.x() * iz, p.y() * iz);
  Mat23 dm;
  dm << iz, 0, -m.x() * iz, 0, iz, -m.y() * iz;
  Vec2 q = m;
  if (distortion == Distortion::kRadtan) {
    const Distorted out = distort_radtan(d, m);
    if (!out.monotonic) return std::nullopt;
    q = out.point;
    dm = out.jacobian * dm;
  }
  if (jacobian != nullptr) {
    jacobian->row(0) = fx * dm.row(0);
    jacobian->row(1) = fy * dm.row(1);
  }
  return Vec2(fx * q.x() + cx, fy * q.y() + cy);
}

std::optional<Vec3> CameraModel::unproject(const Vec2& pixel) const {
  const auto bearing = unproject_in_air(pixel);
  return bearing && port && !straightened ? port->to_water(*bearing) : bearing;
}

Vec3 CameraModel::direction_of(const Vec3& point) const {
  if (!port) return point;
  // The offset at which the ray of the direction from there passes; it hardly depends on that, so
  // secants lead to it at once.
  constexpr int kRounds = 12;
  const auto passed = [&](double offset) { return port->offset(point - offset * port->normal); };
  double before = 0.0;
  double error_before = passed(before);
  double offset = error_before;
  for (int i = 0; i < kRounds; ++i) {
    const double error = passed(offset) - offset;
    if (std::abs(error) < 1e-12 || error == error_before) break;
    const double next = offset - error * (offset - before) / (error - error_before);
    before = std::exchange(offset, next);
    error_before = error;
  }
  return point - offset * port->normal;
}

std::optional<Vec3> CameraModel::unproject_in_air(const Vec2& pixel) const {
  const Vec2 q((pixel.x() - cx) / fx, (pixel.y() - cy) / fy);
  if (distortion == Distortion::kNone) return Vec3(q.x(), q.y(), 1.0).normalized();

  if (distortion == Distortion::kEquidistant) {
    const double theta_d = q.norm();
    if (theta_d < 1e-12) return Vec3(0.0, 0.0, 1.0);
    double theta = theta_d;
    for (int i = 0; i < 30; ++i) {
      double value = 0.0;
      double slope = 0.0;
      equidistant_angle(d, theta, &value, &slope);
      if (slope <= 0.0) return std::nullopt;
      const double step = (value - theta_d) / slope;
      theta -= step;
      if (std::abs(step) < 1e-14) break;
    }
    if (theta < 0.0 || theta > M_PI) return std::nullopt;
    const double s = std::sin(theta) / theta_d;
    return Vec3(s * q.x(), s * q.y(), std::cos(theta));
  }

  Vec2 m = q;
  for (int i = 0; i < 50; ++i) {
    const Distorted out = distort_radtan(d, m);
    const Vec2 error = out.point - q;
    const double det = out.jacobian.determinant();
    if (!std::isfinite(det) || std::abs(det) < 1e-12) return std::nullopt;
    Mat2 inverse;
    inverse << out.jacobian(1, 1), -out.jacobian(0, 1), -out.jacobian(1, 0), out.jacobian(0, 0);
    Vec2 step = inverse * error / det;
    if (step.norm() > 0.5) step *= 0.5 / step.norm();  // keeps Newton inside the monotonic region
    m -= step;
    if (step.squaredNorm() < 1e-28) break;
  }
  const Distorted out = distort_radtan(d, m);
  if (!out.monotonic || (out.point - q).norm() > 1e-9) return std::nullopt;
  return Vec3(m.x(), m.y(), 1.0).normalized();
}

CameraModel CameraModel::downscaled(int factor) const {
  CameraModel out = *this;
  const double f = factor;
  out.width = width / factor;
  out.height = height / factor;
  out.fx = fx / f;
  out.fy = fy / f;
  out.cx = (cx + 0.5) / f - 0.5;
  out.cy = (cy + 0.5) / f - 0.5;
  return out;
}

std::optional<double> centre_behind_port(const CameraModel& camera) {
  constexpr int kSteps = 32;
  CameraModel from_own_centre = camera;
  from_own_centre.port->centre = 0.0;
  double sum = 0.0;
  int count = 0;
  for (int j = 0; j <= kSteps; ++j) {
    for (int i = 0; i <= kSteps; ++i) {
      const Vec2 pixel(i * (camera.width - 1.0) / kSteps, j * (camera.height - 1.0) / kSteps);
      const auto direction = from_own_centre.unproject(pixel);
      if (!direction) continue;
      sum += from_own_centre.port->offset(*direction);
      ++count;
    }
  }
  if (4 * count < kSteps * kSteps) return std::nullopt;
  return sum / count;
}

Mat3 CameraModel::matrix() const {
  Mat3 k;
  k << fx, 0, cx, 0, fy, cy, 0, 0, 1;
  return k;
}

}  // namespace sovo
