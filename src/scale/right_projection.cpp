#include "sovo/scale/right_projection.h"

#include <algorithm>
#include <cmath>

namespace sovo {

namespace {

constexpr float kNowhere = -1e12F;
constexpr float kMinDepth = 1e-4F;  ///< Least z of a ray direction in front of a pinhole.

/// A direction in the right camera, or its derivative by log-scale.
struct Direction {
  float x, y, z;
};

/// Intrinsics at a pyramid level.
struct Intrinsics {
  float fx, fy, cx, cy;
  float d[8];
  float limit;
};

/// A point of the normalized plane and its derivative by log-scale. Nothing here branches: loops
/// over it turn into vector code, and points without a projection are moved away at the end.
struct Moving {
  float x, y, dx, dy;
  float away;  ///< 0, or far away where there is no projection.
};

/// 0 for a positive margin, else far outside of every image.
inline float away(float margin) { return kNowhere * (0.5F - std::copysign(0.5F, margin)); }

/// q is the direction in the right camera, dq its derivative.
inline Moving pinhole(Direction q, Direction dq) {
  const float iz = 1.0F / q.z;
  const float x = q.x * iz;
  const float y = q.y * iz;
  return {x, y, (dq.x - x * dq.z) * iz, (dq.y - y * dq.z) * iz, away(q.z - kMinDepth)};
}

inline Moving radtan(const Intrinsics& c, Direction q, Direction dq) {
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
          m.away + away(c.limit - r2)};
}

/// atan2(r, z) for r >= 0, to 5e-7 rad, without branches: halved argument, then the series.
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
  const float sign = std::copysign(1.0F, z);
  return sign * acute + (1.0F - sign) * static_cast<float>(M_PI_2);
}

inline Moving equidistant(const Intrinsics& c, Direction q, Direction dq) {
  const float* d = c.d;
  const float r2 = q.x * q.x + q.y * q.y + 1e-12F;
  const float r = std::sqrt(r2);
  const float ir = 1.0F / r;
  const float r_dot = (q.x * dq.x + q.y * dq.y) * ir;
  const float theta = angle_to_axis(r, q.z);
  const float theta_dot = (r_dot * q.z - r * dq.z) / (r2 + q.z * q.z);
  const float t2 = theta * theta;
  const float bent = theta * (1.0F + t2 * (d[0] + t2 * (d[1] + t2 * (d[2] + t2 * d[3]))));
  const float slope =
      1.0F + t2 * (3.0F * d[0] + t2 * (5.0F * d[1] + t2 * (7.0F * d[2] + t2 * 9.0F * d[3])));
  const float s = bent * ir;
  const float s_dot = (slope * theta_dot - s * r_dot) * ir;
  return {s * q.x, s * q.y, s_dot * q.x + s * dq.x, s_dot * q.y + s * dq.y, away(c.limit - theta)};
}

/// A flat port before the camera, in single precision.
struct Pane {
  float n[3];
  float water, water2, glass2, distance, thickness, origin;
};

inline float dot(const float* n, Direction d) { return n[0] * d.x + n[1] * d.y + n[2] * d.z; }

/// FlatPort::offset.
inline float ray_offset(const Pane& pane, Direction q) {
  constexpr float kLeast = 1e-4F;
  const float along = dot(pane.n, q);
  const float tan2 = (q.x * q.x + q.y * q.y + q.z * q.z) / (along * along) - 1.0F;
  const float in_air = std::max(kLeast, 1.0F + (1.0F - pane.water2) * tan2);
  const float in_glass = std::max(kLeast, pane.glass2 + (pane.glass2 - pane.water2) * tan2);
  return pane.origin -
         pane.water * (pane.distance / std::sqrt(in_air) + pane.thickness / std::sqrt(in_glass));
}

/// FlatPort::to_air, of a direction and of its derivative; returns how far off the normal light
/// still comes from.
inline float to_air(const Pane& pane, Direction* q, Direction* dq) {
  const float along = dot(pane.n, *q);
  const float along_dot = dot(pane.n, *dq);
  const float squared = q->x * q->x + q->y * q->y + q->z * q->z;
  const float squared_dot = q->x * dq->x + q->y * dq->y + q->z * dq->z;
  const float root2 = (1.0F - pane.water2) * squared + pane.water2 * along * along;
  const float root = std::sqrt(std::max(1e-12F, root2));
  const float root_dot =
      ((1.0F - pane.water2) * squared_dot + pane.water2 * along * along_dot) / root;
  const float bend = root - pane.water * along;
  const float bend_dot = root_dot - pane.water * along_dot;
  *q = {pane.water * q->x + bend * pane.n[0], pane.water * q->y + bend * pane.n[1],
        pane.water * q->z + bend * pane.n[2]};
  *dq = {pane.water * dq->x + bend_dot * pane.n[0], pane.water * dq->y + bend_dot * pane.n[1],
         pane.water * dq->z + bend_dot * pane.n[2]};
  return std::min(along, root2 - 1e-4F * squared);
}

/// What is left to where a, b, c, ... lead to, when its steps shrink by equal shares.
inline float aitken(float a, float b, float c) {
  const float step = c - b;
  const float bend = step - (b - a);
  // Steps that hardly shrink, for there are none, lead nowhere.
  return -step * step * bend / (bend * bend + 1e-14F);
}

/// m + w (begin - own normal).
inline Direction seen_from(Direction m, float w, Direction begin, Direction normal, float own) {
  return {m.x + w * (begin.x - own * normal.x), m.y + w * (begin.y - own * normal.y),
          m.z + w * (begin.z - own * normal.z)};
}

template <Distortion D>
inline Moving distorted(const Intrinsics& c, Direction q, Direction dq) {
  if constexpr (D == Distortion::kEquidistant) return equidistant(c, q, dq);
  if constexpr (D == Distortion::kRadtan) return radtan(c, q, dq);
  return pinhole(q, dq);
}

/// Direction m + w t with w = rho / s; dw / d log-scale = -w.
template <Distortion D>
void project_all(const Intrinsics c, const ScalePoints& points, float inverse_scale,
                 ScaleProjections* out) {
  const float* mx = points.mx.data();
  const float* my = points.my.data();
  const float* mz = points.mz.data();
  const float* rho = points.inverse_depth.data();
  float* x = out->x.data();
  float* y = out->y.data();
  float* jx = out->jx.data();
  float* jy = out->jy.data();
  const float tx = points.t[0];
  const float ty = points.t[1];
  const float tz = points.t[2];
  const int n = points.padded;
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) {
    const float w = rho[i] * inverse_scale;
    const Direction dq = {-w * tx, -w * ty, -w * tz};
    const Direction q = {mx[i] - dq.x, my[i] - dq.y, mz[i] - dq.z};
    const Moving m = distorted<D>(c, q, dq);
    x[i] = c.fx * m.x + c.cx + m.away;
    y[i] = c.fy * m.y + c.cy + m.away;
    jx[i] = c.fx * m.dx;
    jy[i] = c.fy * m.dy;
  }
}

/// The same through a port: the direction is m + w (t + o - o'), where the left ray begins at o and
/// the right one at o', which two rounds find.
template <Distortion D>
void project_through(const Pane pane, const Intrinsics c, const ScalePoints& points,
                     float inverse_scale, ScaleProjections* out) {
  const float* mx = points.mx.data();
  const float* my = points.my.data();
  const float* mz = points.mz.data();
  const float* rho = points.inverse_depth.data();
  const float* ray_offsets = points.ray_offset.data();
  float* x = out->x.data();
  float* y = out->y.data();
  float* jx = out->jx.data();
  float* jy = out->jy.data();
  const Direction t = {points.t[0], points.t[1], points.t[2]};
  const Direction left = {points.normal[0], points.normal[1], points.normal[2]};
  const Direction right = {pane.n[0], pane.n[1], pane.n[2]};
  const int n = points.padded;
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) {
    const float w = rho[i] * inverse_scale;
    const float o = ray_offsets[i];
    const Direction m = {mx[i], my[i], mz[i]};
    const Direction begin = {t.x + o * left.x, t.y + o * left.y, t.z + o * left.z};
    const float first = ray_offset(pane, seen_from(m, w, begin, right, 0.0F));
    const float second = ray_offset(pane, seen_from(m, w, begin, right, first));
    const float own = second + aitken(0.0F, first, second);
    Direction q = seen_from(m, w, begin, right, own);
    Direction dq = {m.x - q.x, m.y - q.y, m.z - q.z};
    const float margin = to_air(pane, &q, &dq);
    const Moving p = distorted<D>(c, q, dq);
    const float gone = p.away + away(margin);
    x[i] = c.fx * p.x + c.cx + gone;
    y[i] = c.fy * p.y + c.cy + gone;
    jx[i] = c.fx * p.dx;
    jy[i] = c.fy * p.dy;
  }
}

Pane pane_of(const FlatPort& port) {
  const auto f = [](double v) { return static_cast<float>(v); };
  return {{f(port.normal.x()), f(port.normal.y()), f(port.normal.z())},
          f(port.water),
          f(port.water * port.water),
          f(port.glass * port.glass),
          f(port.distance),
          f(port.thickness),
          f(port.distance + port.thickness - port.centre)};
}

template <Distortion D>
void project_camera(const CameraModel& camera, const Intrinsics& c, const ScalePoints& points,
                    float inverse_scale, ScaleProjections* out) {
  if (camera.port) return project_through<D>(pane_of(*camera.port), c, points, inverse_scale, out);
  project_all<D>(c, points, inverse_scale, out);
}

/// Largest value below which the distorted radius still grows, found by the model's own verdict.
float folding_limit(CameraModel camera) {
  camera.port.reset();  // directions are of air by then
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
      return project_camera<Distortion::kRadtan>(camera_, c, points, inverse_scale, out);
    case Distortion::kEquidistant:
      return project_camera<Distortion::kEquidistant>(camera_, c, points, inverse_scale, out);
    case Distortion::kNone:
      return project_camera<Distortion::kNone>(camera_, c, points, inverse_scale, out);
  }
}

}  // namespace sovo
