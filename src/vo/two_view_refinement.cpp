#include "sovo/vo/two_view_refinement.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sovo/geometry/linear_solvers.h"
#include "sovo/image/interpolation.h"
#include "sovo/vo/pattern.h"

namespace sovo {
namespace {

using Vec8f = Eigen::Matrix<float, 8, 1>;
using Mat8f = Eigen::Matrix<float, 8, 8>;

constexpr float kEnergyOutOfView = 1e9F;

/// Contribution of one point: 8 shared unknowns (x), one of its own (rho).
///     [ H_xx  H_xr ] [dx]     [g_x]
///     [ H_rx  H_rr ] [dr] = - [g_r]
struct PointSystem {
  Mat8f H_xx;
  Vec8f H_xr, g_x;
  float H_rr = 0.F, g_r = 0.F, energy = 0.F;
};

float level_position(float x, int level) {
  return (x + 0.5F) / static_cast<float>(1 << level) - 0.5F;
}

struct Level {
  const ImageF& first;
  const ImageF& second;
  CameraModel camera;
  int level;
};

/// Residuals of one point's pattern; false when a pixel of it is out of view.
bool linearize_point(const Level& level, const TwoViewRefinementConfig& config,
                     const TwoViewState& state, const TwoViewPoint& point, float inverse_depth,
                     PointSystem* system) {
  system->H_xx.setZero();
  system->H_xr.setZero();
  system->g_x.setZero();
  system->H_rr = system->g_r = system->energy = 0.0F;
  const float x = level_position(point.u, level.level);
  const float y = level_position(point.v, level.level);
  if (!in_image(level.first, x, y, 2.0F)) return false;
  const float huber = static_cast<float>(config.huber);
  const float c2 = static_cast<float>(config.gradient_weight * config.gradient_weight);
  for (const auto& offset : kPattern) {
    TwoViewPixel pixel;
    if (!evaluate_pixel(level.first, level.second, level.camera, state, x + offset.x, y + offset.y,
                        inverse_depth, &pixel)) {
      return false;
    }
    const float magnitude = std::abs(pixel.residual);
    const float h = magnitude < huber ? 1.0F : huber / magnitude;
    const float weight = c2 / (c2 + pixel.gradient_squared);
    const float w = h * weight;
    system->energy += weight * h * pixel.residual * pixel.residual * (2.0F - h);
    const Eigen::Map<const Vec8f> J(pixel.J.data());
    system->H_xx.noalias() += w * J * J.transpose();
    system->H_xr += w * pixel.J_rho * J;
    system->g_x += w * pixel.residual * J;
    system->H_rr += w * pixel.J_rho * pixel.J_rho;
    system->g_r += w * pixel.residual * pixel.J_rho;
  }
  return true;
}

/// Weight of the pull towards the neighbourhood's inverse depth, in units of squared residuals of
/// 5 grey levels.
float expected_weight(const TwoViewRefinementConfig& config, const TwoViewPoint& point) {
  const float sigma = static_cast<float>(config.expected_sigma) * std::max(point.expected, 1e-3F);
  return 25.0F / (sigma * sigma);
}

struct Pass {
  Mat8 H = Mat8::Zero();  // after elimination of the depths
  Vec8 g = Vec8::Zero();
  double energy = 0.0;
  int points = 0;
};

/// Linearizes all points at `state` and `depths`, and eliminates the depths damped by `lambda`.
Pass linearize_all(const Level& level, const TwoViewRefinementConfig& config,
                   const TwoViewState& state, const std::vector<float>& depths, double lambda,
                   const std::vector<TwoViewPoint>& points, std::vector<PointSystem>* systems) {
  Pass pass;
  for (std::size_t i = 0; i < points.size(); ++i) {
    PointSystem& s = (*systems)[i];
    if (!points[i].good || !linearize_point(level, config, state, points[i], depths[i], &s)) {
      s.energy = kEnergyOutOfView;
      continue;
    }
    const float pull = expected_weight(config, points[i]);
    const float difference = depths[i] - points[i].expected;
    pass.energy += static_cast<double>(s.energy + pull * difference * difference);
    ++pass.points;
    const double H_rr = static_cast<double>(s.H_rr + pull) * (1.0 + lambda);
    const double g_r = static_cast<double>(s.g_r + pull * difference);
    const Vec8 H_xr = s.H_xr.cast<double>();
    pass.H += s.H_xx.cast<double>() - H_xr * H_xr.transpose() / H_rr;
    pass.g += s.g_x.cast<double>() - H_xr * (g_r / H_rr);
  }
  return pass;
}

TwoViewState updated(const TwoViewState& state, const Vec8& step, double length) {
  TwoViewState next = state;
  next.T_1_0 = SE3::exp(step.head<6>()) * state.T_1_0;
  next.T_1_0.translation() *= length / next.T_1_0.translation().norm();
  next.a += step[6];
  next.b += step[7];
  return next;
}

/// Shared step, then each depth's: dr = -(g_r + H_rx dx) / H_rr.
Vec8 solve(const Pass& pass, const TwoViewState& state, double lambda) {
  Mat8 H = pass.H;
  // The scale is free: hold the translation along itself.
  const Vec3 along = state.T_1_0.translation().normalized();
  H.topLeftCorner<3, 3>() += 1e3 * H.diagonal().head<3>().maxCoeff() * along * along.transpose();
  H.diagonal() *= 1.0 + lambda;
  Vec8 scale = (H.diagonal().array().abs() + 10.0).rsqrt();
  const Mat8 scaled = scale.asDiagonal() * H * scale.asDiagonal();
  const Vec8 right = scale.cwiseProduct(pass.g);
  return -scale.cwiseProduct(solve_small(scaled, right));
}

std::vector<float> step_depths(const TwoViewRefinementConfig& config, const Vec8& step,
                               double lambda, const std::vector<TwoViewPoint>& points,
                               const std::vector<PointSystem>& systems,
                               const std::vector<float>& depths) {
  std::vector<float> next = depths;
  const Vec8f x = step.cast<float>();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const PointSystem& s = systems[i];
    if (s.energy >= kEnergyOutOfView) continue;
    const float pull = expected_weight(config, points[i]);
    const float g = s.g_r + pull * (depths[i] - points[i].expected) + s.H_xr.dot(x);
    const float H = (s.H_rr + pull) * static_cast<float>(1.0 + lambda);
    const float bound = 0.5F * std::max(depths[i], 0.02F);
    next[i] = std::max(1e-4F, depths[i] + std::clamp(-g / H, -bound, bound));
  }
  return next;
}

/// Levenberg-Marquardt at one level on the mean energy of the points in view.
double refine_level(const Level& level, const TwoViewRefinementConfig& config, TwoViewState* state,
                    std::vector<TwoViewPoint>* points) {
  const double length = state->T_1_0.translation().norm();
  std::vector<PointSystem> systems(points->size()), trial_systems(points->size());
  std::vector<float> depths(points->size());
  for (std::size_t i = 0; i < points->size(); ++i) depths[i] = (*points)[i].inverse_depth;
  double lambda = 0.01;
  Pass pass = linearize_all(level, config, *state, depths, lambda, *points, &systems);
  if (pass.points < 20) return std::numeric_limits<double>::infinity();
  for (int iteration = 0; iteration < config.max_iterations; ++iteration) {
    const Vec8 step = solve(pass, *state, lambda);
    if (!step.allFinite()) return std::numeric_limits<double>::infinity();
    const TwoViewState trial = updated(*state, step, length);
    const std::vector<float> next = step_depths(config, step, lambda, *points, systems, depths);
    const double next_lambda = std::max(1e-5, lambda * 0.3);
    const Pass trial_pass =
        linearize_all(level, config, trial, next, next_lambda, *points, &trial_systems);
    const double before = pass.energy / pass.points;
    const double after = trial_pass.points < 20 ? 1e300 : trial_pass.energy / trial_pass.points;
    if (after < before) {
      *state = trial;
      depths = next;
      pass = trial_pass;
      systems.swap(trial_systems);
      lambda = next_lambda;
      if (before - after < 1e-4 * before) break;
    } else {
      lambda *= 10.0;
      if (lambda > 1e3) break;
      pass = linearize_all(level, config, *state, depths, lambda, *points, &systems);
    }
  }
  for (std::size_t i = 0; i < points->size(); ++i) {
    TwoViewPoint& p = (*points)[i];
    p.inverse_depth = depths[i];
    p.good = p.good && (systems[i].energy < kEnergyOutOfView || level.level > 0);
    p.energy = systems[i].energy / static_cast<float>(kPattern.size());
    p.information = systems[i].H_rr;
  }
  return std::sqrt(pass.energy / (pass.points * static_cast<double>(kPattern.size())));
}

}  // namespace

bool evaluate_pixel(const ImageF& first, const ImageF& second, const CameraModel& camera,
                    const TwoViewState& state, float x, float y, float inverse_depth,
                    TwoViewPixel* pixel) {
  const Vec3 ray((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1.0);
  const Vec3& t = state.T_1_0.translation();
  const Vec3 P = state.T_1_0.rotation() * ray + inverse_depth * t;
  if (P.z() < 0.05) return false;
  const float iz = static_cast<float>(1.0 / P.z());
  const float px = static_cast<float>(P.x()) * iz;
  const float py = static_cast<float>(P.y()) * iz;
  const float u = static_cast<float>(camera.fx) * px + static_cast<float>(camera.cx);
  const float v = static_cast<float>(camera.fy) * py + static_cast<float>(camera.cy);
  if (!in_image(second, u, v)) return false;
  const Sample s = sample_with_gradient(second, u, v);
  const float value = sample(first, x, y);
  const float a = static_cast<float>(state.a);
  pixel->residual = s.value - a * value - static_cast<float>(state.b);
  pixel->gradient_squared = s.gx * s.gx + s.gy * s.gy;
  const float gx = s.gx * static_cast<float>(camera.fx);
  const float gy = s.gy * static_cast<float>(camera.fy);
  // dP = rho v + w x P for a left increment (v, w); d rho adds t.
  const float gz = -(gx * px + gy * py);
  const float d = inverse_depth * iz;
  pixel->J = {gx * d,
              gy * d,
              gz * d,
              -gx * px * py - gy * (1.0F + py * py),
              gx * (1.0F + px * px) + gy * px * py,
              -gx * py + gy * px,
              -value,
              -1.0F};
  pixel->J_rho = iz * (gx * static_cast<float>(t.x()) + gy * static_cast<float>(t.y()) +
                       gz * static_cast<float>(t.z()));
  return true;
}

double refine_two_views(const ImagePyramid& first, const ImagePyramid& second,
                        const CameraModel& camera, const TwoViewRefinementConfig& config,
                        int coarsest, TwoViewState* state, std::vector<TwoViewPoint>* points) {
  double rms = std::numeric_limits<double>::infinity();
  for (int l = std::min(coarsest, first.num_levels() - 1); l >= 0; --l) {
    rms = refine_level({first[l], second[l], camera.at_level(l), l}, config, state, points);
    if (!std::isfinite(rms)) return rms;
  }
  return rms;
}

namespace {

/// Sum of truncated squared residuals of the pattern; infinity when it leaves the second view.
float pattern_energy(const ImageF& first, const ImageF& second, const CameraModel& camera,
                     const TwoViewState& state, float u, float v, float inverse_depth) {
  float energy = 0.0F;
  for (const auto& offset : kPattern) {
    TwoViewPixel pixel;
    if (!evaluate_pixel(first, second, camera, state, u + offset.x, v + offset.y, inverse_depth,
                        &pixel)) {
      return std::numeric_limits<float>::infinity();
    }
    energy += std::min(pixel.residual * pixel.residual, 900.0F);
  }
  return energy;
}

}  // namespace

bool search_inverse_depth(const ImageF& first, const ImageF& second, const CameraModel& camera,
                          const TwoViewState& state, float low, float high, TwoViewPoint* point) {
  constexpr int kMaxSteps = 80;
  constexpr float kNoiseEnergy = 8.0F * 16.0F;  // noise of 4 grey levels in each pixel
  constexpr float kUniqueness = 1.5F;           // least energy of any other match, relative
  const Vec3 ray((point->u - camera.cx) / camera.fx, (point->v - camera.cy) / camera.fy, 1.0);
  const auto project = [&](float rho) {
    const Vec3 P = state.T_1_0.rotation() * ray + rho * state.T_1_0.translation();
    return Vec2(camera.fx * P.x() / P.z(), camera.fy * P.y() / P.z());
  };
  const double length = (project(high) - project(low)).norm();
  const int steps = std::clamp(static_cast<int>(std::ceil(length)), 1, kMaxSteps);
  std::array<float, kMaxSteps + 1> energies{};
  int best = 0;
  for (int i = 0; i <= steps; ++i) {
    const float rho = low + (high - low) * static_cast<float>(i) / static_cast<float>(steps);
    energies[static_cast<std::size_t>(i)] =
        pattern_energy(first, second, camera, state, point->u, point->v, rho);
    if (energies[static_cast<std::size_t>(i)] < energies[static_cast<std::size_t>(best)]) best = i;
  }
  const float lowest = energies[static_cast<std::size_t>(best)];
  if (!std::isfinite(lowest)) return false;
  for (int i = 0; i <= steps; ++i) {
    if (std::abs(i - best) <= 2) continue;
    if (energies[static_cast<std::size_t>(i)] + kNoiseEnergy <
        kUniqueness * (lowest + kNoiseEnergy)) {
      return false;
    }
  }
  const float best_rho = low + (high - low) * static_cast<float>(best) / static_cast<float>(steps);
  point->inverse_depth = best_rho;
  return true;
}

}  // namespace sovo
