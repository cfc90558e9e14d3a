#include "sovo/scale/paper_scale.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sovo/image/interpolation.h"

namespace sovo {

namespace {

constexpr double kHuber = 9.0;  ///< Threshold of the norm [grey levels].
constexpr double kStop = 1e-3;  ///< Increment of s over s that ends a level.
constexpr int kMaxLevels = 5;
constexpr double kMaxTrackingChange = 0.5;  ///< |s - 1| without a cold start.
constexpr std::array<double, 8> kGuesses = {0.1, 0.25, 0.6, 1.5, 4.0, 10.0, 25.0, 50.0};

/// Sums over the points at one scale.
struct Sums {
  double H = 0.0, b = 0.0, energy = 0.0, squares = 0.0;
  int count = 0;
  double mean_energy() const { return count > 0 ? energy / count : 1e12; }
  double rmse() const { return count > 0 ? std::sqrt(squares / count) : 1e12; }
};

struct Level {
  const CameraModel camera;
  const ImageF& image;
};

/// d pixel / d s at P = s X' + t, and the pixel (the expression for d Pi_1 / d s after eq. 6).
std::optional<Vec2> project(const CameraModel& camera, const Vec3& X, const Vec3& t, double s,
                            Vec2* derivative) {
  const Vec3 P = s * X + t;
  if (!camera.is_pinhole()) {  // the same by the chain rule
    Mat23 jacobian;
    const auto pixel = camera.project(camera.direction_of(P), &jacobian);
    if (pixel) *derivative = jacobian * X;
    return pixel;
  }
  if (P.z() <= 1e-9) return std::nullopt;
  const double z2 = P.z() * P.z();
  *derivative = {camera.fx * (X.x() * t.z() - X.z() * t.x()) / z2,
                 camera.fy * (X.y() * t.z() - X.z() * t.y()) / z2};
  return Vec2(camera.fx * P.x() / P.z() + camera.cx, camera.fy * P.y() / P.z() + camera.cy);
}

/// Energy of eq. 4 and its normal equation at scale s.
Sums accumulate(const ScalePoints& points, const Level& level, double s) {
  Sums sums;
  for (std::size_t i = 0; i < static_cast<std::size_t>(points.size); ++i) {
    const Vec3 ray(static_cast<double>(points.mx[i]), static_cast<double>(points.my[i]),
                   static_cast<double>(points.mz[i]));
    const Vec3 X = ray / static_cast<double>(points.inverse_depth[i]);
    Vec2 dpi_ds;
    const Vec3 t = points.translation(i).cast<double>();
    const auto pixel = project(level.camera, X, t, s, &dpi_ds);
    if (!pixel) continue;
    const auto x = static_cast<float>(pixel->x());
    const auto y = static_cast<float>(pixel->y());
    if (!in_image(level.image, x, y)) continue;
    const Sample sampled = sample_with_gradient(level.image, x, y);
    const double r = static_cast<double>(sampled.value - points.reference[i]);  // eq. 5
    const double J = static_cast<double>(sampled.gx) * dpi_ds.x() +
                     static_cast<double>(sampled.gy) * dpi_ds.y();  // eq. 6
    const double w = std::abs(r) < kHuber ? 1.0 : kHuber / std::abs(r);
    sums.H += w * J * J;
    sums.b += w * J * r;
    sums.energy += w * r * r * (2.0 - w);  // Huber norm, twice
    sums.squares += r * r;
    ++sums.count;
  }
  return sums;
}

/// Gauss-Newton on one level; a step that raises the mean energy ends it.
Sums minimize(const ScaleOptimizerConfig& config, const ScalePoints& points, const Level& level,
              double* s, int* iterations) {
  Sums sums = accumulate(points, level, *s);
  for (int i = 0; i < config.max_iterations && sums.H > 0.0; ++i) {
    const double increment = -sums.b / sums.H;
    const double next = *s + increment;  // s_new = s_old + s_inc
    if (!(std::abs(increment) < *s)) break;
    const Sums trial = accumulate(points, level, next);
    ++*iterations;
    if (!(trial.mean_energy() < sums.mean_energy())) break;
    *s = next;
    sums = trial;
    if (std::abs(increment) < kStop * *s) break;
  }
  return sums;
}

struct Descent {
  double s;
  Sums sums;
};

Descent descend(const ScaleOptimizerConfig& config, const StereoRig& rig, const ImagePyramid& left,
                const ImagePyramid& right, double start, ScalePoints* points, int* iterations) {
  Descent out{start, {}};
  const int levels = std::min({left.num_levels(), right.num_levels(), kMaxLevels});
  for (int l = levels - 1; l >= 0; --l) {
    points->sample_reference(left[l], l);
    const Level level{rig.right.at_level(l), right[l]};
    out.sums = minimize(config, *points, level, &out.s, iterations);
  }
  return out;
}

ScaleVerdict verdict_of(const ScaleOptimizerConfig& config, const Descent& best, int size,
                        bool cold_start) {
  const int needed = std::max(config.min_points, static_cast<int>(config.min_visible * size));
  if (best.sums.count < needed) return ScaleVerdict::kTooFewPoints;
  if (!(best.sums.H > 0.0)) return ScaleVerdict::kUnobservable;
  if (best.sums.rmse() >= config.paper_max_residual) return ScaleVerdict::kTooFewInliers;
  if (!cold_start && std::abs(best.s - 1.0) > kMaxTrackingChange) return ScaleVerdict::kOutOfRange;
  return ScaleVerdict::kAccepted;
}

}  // namespace

ScaleEstimate estimate_paper_scale(const ScaleOptimizerConfig& config, const StereoRig& rig,
                                   const KeyframeSnapshot& keyframe, const ImagePyramid& right,
                                   bool cold_start, ScaleWorkspace* workspace) {
  ScaleEstimate out;
  ScalePoints* points = &workspace->points;
  const auto run = [&](double start) {
    return descend(config, rig, *keyframe.pyramid, right, start, points, &out.iterations);
  };
  Descent best = run(cold_start ? kGuesses[0] : 1.0);
  const int needed = static_cast<int>(config.min_visible * points->size);
  for (std::size_t i = 1; cold_start && i < kGuesses.size(); ++i) {
    const Descent other = run(kGuesses[i]);
    const bool visible = other.sums.count >= needed;
    if (visible && (best.sums.count < needed || other.sums.rmse() < best.sums.rmse())) {
      best = other;
    }
  }
  out.log_scale = std::log(best.s);
  out.num_points = best.sums.count;
  out.residual = best.sums.rmse();
  out.inlier_ratio = points->size > 0 ? static_cast<double>(best.sums.count) / points->size : 0.0;
  // Not in the paper: variance of s from the normal equation, over s^2.
  out.sigma =
      best.sums.H > 0.0
          ? std::sqrt(config.variance_factor * best.sums.squares / best.sums.count / best.sums.H) /
                best.s
          : 1e3;
  out.verdict = verdict_of(config, best, points->size, cold_start);
  return out;
}

}  // namespace sovo
