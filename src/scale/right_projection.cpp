#include "sovo/scale/right_projection.h"

#include <algorithm>
#include <cmath>

namespace sovo {

namespace {

constexpr float kNowhere = -1e6F;
constexpr float kMinDepth = 1e-4F;  ///< Least z of a ray direction in front of a pinhole.

/// Intrinsics at a pyramid level.
struct Intrinsics {
  float fx, fy, cx, cy;
  float d[8];
  float limit;
};

/// A point of the normalized plane and its derivative by log-scale.
struct Moving {
  float x, y, dx, dy;
  bool valid;
};

/// q is the direction in the right camera, dq its derivative.
inline Moving pinhole(const float q[3], const float dq[3]) {
  const bool front = q[2] > kMinDepth;
  const float iz = 1.0F / (front ? q[2] : 1.0F);
  const float x = q[0] * iz;
  const float y = q[1] * iz;
  return {x, y, (dq[0] - x * dq[2]) * iz, (dq[1] - y * dq[2]) * iz, front};
}

inline Moving radtan(const Intrinsics& c, const float q[3], const float dq[3]) {
  const Moving m = pinhole(q, dq);
  const float* d = c.d;
  const float r2 = m.x * m.x + m.y * m.y;
  const float r2_dot = 2.0F * (m.x * m.dx + m.y * m.dy);
  const float num = 1.0F + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
  const float den = 1.0F + r2 * (d[5] + r2 * (d[6] + r2 * d[7]));
  const float num_d = d[0] + r2 * (2.0F * d[1] + r2 * 3.0F * d[4]);
  const float den_d = d[5] + r2 * (2.0F * d[6] + r2 * 3.0F * d[7]);
  const float inverse = 1.0F / den;
  const float g = num * inverse;
  const float g_dot = (num_d - g * den_d) * inverse * r2_dot;
  const float xy_dot = m.x * m.dy + m.y * m.dx;
  return {m.x * g + 2.0F * d[2] * m.x * m.y + d[3] * (r2 + 2.0F * m.x * m.x),
          m.y * g + d[2] * (r2 + 2.0F * m.y * m.y) + 2.0F * d[3] * m.x * m.y,
          m.dx * g + m.x * g_dot + 2.0F * d[2] * xy_dot + d[3] * (r2_dot + 4.0F * m.x * m.dx),
          m.dy * g + m.y * g_dot + d[2] * (r2_dot + 4.0F * m.y * m.dy) + 2.0F * d[3] * xy_dot,
          m.valid && r2 < c.limit};
}

/// atan2(r, z) for r >= 0, to 2e-7 rad, without branches: halved argument, then the series.
inline float angle_to_axis(float r, float z) {
  const float n = std::sqrt(r * r + z * z);
  const float low = r / (n + std::abs(z));  // tan of half the angle to the nearer half axis, <= 1
  const float a = low / (1.0F + std::sqrt(1.0F + low * low));  // of a quarter, <= 0.4143
  const float a2 = a * a;
  const float series =
      a *
      (1.0F + a2 * (-1.0F / 3.0F +
                    a2 * (1.0F / 5.0F +
                          a2 * (-1.0F / 7.0F +
                                a2 * (1.0F / 9.0F + a2 * (-1.0F / 11.0F + a2 * (1.0F / 13.0F)))))));
  const float acute = 4.0F * series;
  return z >= 0.0F ? acute : static_cast<float>(M_PI) - acute;
}

inline Moving equidistant(const Intrinsics& c, const float q[3], const float dq[3]) {
  const float* d = c.d;
  const float r2 = q[0] * q[0] + q[1] * q[1] + 1e-12F;
  const float r = std::sqrt(r2);
  const float ir = 1.0F / r;
  const float r_dot = (q[0] * dq[0] + q[1] * dq[1]) * ir;
  const float theta = angle_to_axis(r, q[2]);
  const float theta_dot = (r_dot * q[2] - r * dq[2]) / (r2 + q[2] * q[2]);
  const float t2 = theta * theta;
  const float bent = theta * (1.0F + t2 * (d[0] + t2 * (d[1] + t2 * (d[2] + t2 * d[3]))));
  const float slope =
      1.0F + t2 * (3.0F * d[0] + t2 * (5.0F * d[1] + t2 * (7.0F * d[2] + t2 * 9.0F * d[3])));
  const float s = bent * ir;
  const float s_dot = (slope * theta_dot - s * r_dot) * ir;
  return {s * q[0], s * q[1], s_dot * q[0] + s * dq[0], s_dot * q[1] + s * dq[1], theta < c.limit};
}

template <Distortion D>
inline Moving distorted(const Intrinsics& c, const float q[3], const float dq[3]) {
  if constexpr (D == Distortion::kEquidistant) return equidistant(c, q, dq);
  if constexpr (D == Distortion::kRadtan) return radtan(c, q, dq);
  return pinhole(q, dq);
}

/// Direction m + w t with w = rho / s; dw / d log-scale = -w.
template <Distortion D>
void project_all(const Intrinsics c, const ScalePoints& points, float inverse_scale,
                 ScaleProjections* out) {
  const float* __restrict mx = points.mx.data();
  const float* __restrict my = points.my.data();
  const float* __restrict mz = points.mz.data();
  const float* __restrict rho = points.inverse_depth.data();
  float* __restrict x = out->x.data();
  float* __restrict y = out->y.data();
  float* __restrict jx = out->jx.data();
  float* __restrict jy = out->jy.data();
  const float tx = points.t[0];
  const float ty = points.t[1];
  const float tz = points.t[2];
  const int n = points.padded;
  for (int i = 0; i < n; ++i) {
    const float w = rho[i] * inverse_scale;
    const float dq[3] = {-w * tx, -w * ty, -w * tz};
    const float q[3] = {mx[i] - dq[0], my[i] - dq[1], mz[i] - dq[2]};
    const Moving m = distorted<D>(c, q, dq);
    x[i] = m.valid ? c.fx * m.x + c.cx : kNowhere;
    y[i] = m.valid ? c.fy * m.y + c.cy : kNowhere;
    jx[i] = m.valid ? c.fx * m.dx : 0.0F;
    jy[i] = m.valid ? c.fy * m.dy : 0.0F;
  }
}

/// Largest value below which the distorted radius still grows, found by the model's own verdict.
float folding_limit(const CameraModel& camera) {
  if (camera.distortion == Distortion::kNone) return 0.0F;
  const bool fisheye = camera.distortion == Distortion::kEquidistant;
  const double step = 1e-3;
  for (double angle = step; angle < (fisheye ? M_PI : 1.55); angle += step) {
    const bool valid = camera.project(Vec3(std::sin(angle), 0.0, std::cos(angle))).has_value() &&
                       camera.project(Vec3(0.0, std::sin(angle), std::cos(angle))).has_value();
    if (valid) continue;
    const double last = angle - step;
    return static_cast<float>(fisheye ? last : std::tan(last) * std::tan(last));
  }
  return fisheye ? static_cast<float>(M_PI) : 1e4F;
}

Intrinsics intrinsics(const CameraModel& camera, int level, float limit) {
  const CameraModel c = camera.at_level(level);
  Intrinsics out{static_cast<float>(c.fx),
                 static_cast<float>(c.fy),
                 static_cast<float>(c.cx),
                 static_cast<float>(c.cy),
                 {},
                 limit};
  for (std::size_t i = 0; i < 8; ++i) out.d[i] = static_cast<float>(c.d[i]);
  return out;
}

}  // namespace

void ScaleProjections::resize(int padded) {
  for (auto* array : {&x, &y, &jx, &jy}) array->resize(static_cast<std::size_t>(padded));
}

RightProjection::RightProjection(const CameraModel& camera)
    : camera_(camera), limit_(folding_limit(camera)) {}

void RightProjection::project(const ScalePoints& points, double sigma, int level,
                              ScaleProjections* out) const {
  out->resize(points.padded);
  const Intrinsics c = intrinsics(camera_, level, limit_);
  const auto inverse_scale = static_cast<float>(std::exp(-sigma));
  switch (camera_.distortion) {
    case Distortion::kRadtan:
      return project_all<Distortion::kRadtan>(c, points, inverse_scale, out);
    case Distortion::kEquidistant:
      return project_all<Distortion::kEquidistant>(c, points, inverse_scale, out);
    case Distortion::kNone:
      return project_all<Distortion::kNone>(c, points, inverse_scale, out);
  }
}

}  // namespace sovo
