#include "sovo/vo/bundle_adjustment.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "sovo/geometry/linear_solvers.h"
#include "sovo/vo/lens_equations.h"
#include "sovo/vo/static_residual.h"

namespace sovo {

namespace {

// Of the first keyframe: it is the world.
constexpr double kGaugePose = 1e11;
constexpr double kGaugeBrightness = 1e10;

/// Orthonormal basis of the span of at most seven columns; nearly dependent ones add nothing.
MatX orthonormalized(MatX n) {
  for (Eigen::Index c = 0; c < n.cols(); ++c) {
    const double norm = n.col(c).norm();
    if (norm > 1e-12) n.col(c) /= norm;
  }
  const SymmetricEigen eigen = symmetric_eigen(n.transpose() * n);
  const VecX& values = eigen.values;
  constexpr double kCut = 1e-10;  // of squared lengths
  Eigen::Index first = 0;
  while (first < values.size() && values[first] <= kCut * values[values.size() - 1]) ++first;
  const Eigen::Index rank = values.size() - first;
  return n * eigen.vectors.rightCols(rank) *
         values.tail(rank).cwiseSqrt().cwiseInverse().asDiagonal();
}

/// Largest angle between the optical axes of two keyframes [rad].
double widest_turn(const Window& window) {
  double cosine = 1.0;
  for (int i = 0; i < window.size(); ++i) {
    const Vec3 axis = window[i].T_camera_world.rotation_matrix().row(2);
    for (int j = 0; j < i; ++j) {
      cosine = std::min(cosine, window[j].T_camera_world.rotation_matrix().row(2).dot(axis));
    }
  }
  return std::acos(std::clamp(cosine, -1.0, 1.0));
}

}  // namespace

void BundleAdjuster::Backup::take(const Window& window, const std::vector<PointRef>& points) {
  x.clear();
  rho.clear();
  for (int i = 0; i < window.size(); ++i) x.push_back(window[i].x);
  for (const PointRef& ref : points) rho.push_back(ref.point->rho);
}

void BundleAdjuster::Backup::restore(Window* window, const std::vector<PointRef>& points) const {
  for (int i = 0; i < window->size(); ++i) (*window)[i].set_x(x[static_cast<std::size_t>(i)]);
  for (std::size_t i = 0; i < points.size(); ++i) points[i].point->rho = rho[i];
  window->update_geometry();
}

FramePrior frame_prior(const Keyframe& k, const WindowConfig& config) {
  FramePrior prior;
  prior.weight[6] = config.prior_a;
  prior.weight[7] = config.prior_b;
  prior.error[6] = k.affine.a;
  prior.error[7] = k.affine.b;
  if (k.id == 0) {
    prior.weight.head<6>().setConstant(kGaugePose);
    prior.error.head<6>() = k.x.head<6>();
    prior.weight.tail<2>().setConstant(kGaugeBrightness);
  }
  return prior;
}

double BundleAdjuster::prior_energy(const Window& window) const {
  const VecX x = window.stacked_x();
  double energy = x.dot(window.prior().H * x) + 2.0 * window.prior().b.dot(x);
  for (int i = 0; i < window.size(); ++i) {
    const FramePrior p = frame_prior(window[i], config_);
    energy += p.error.dot(p.weight.cwiseProduct(p.error));
  }
  return energy;
}

void BundleAdjuster::update_outlier_threshold(const WindowLinearization& linearized,
                                              Window* window) const {
  std::vector<float> energies;
  energies.reserve(linearized.depths.size());
  const int newest = window->size() - 1;
  for (const StoredResidual& r : linearized.residuals) {
    if (r.target == newest && r.state != ResidualState::kOutOfView) {
      energies.push_back(r.raw_energy);
    }
  }
  double& threshold = window->newest().outlier_threshold;
  if (energies.empty()) {
    threshold = kPatternSize * config_.outlier_threshold;
    return;
  }
  const auto nth =
      energies.begin() + static_cast<std::ptrdiff_t>(0.7 * static_cast<double>(energies.size()));
  std::nth_element(energies.begin(), nth, energies.end());
  const double e = 13.0 + 0.75 * std::sqrt(static_cast<double>(*nth));
  threshold = e * e;
}

VecX BundleAdjuster::state_units(const Window& window) {
  const double depth = 1.0 / window.mean_inverse_depth();
  Vec8 unit;
  unit << Vec3::Constant(0.5 * depth), Vec3::Ones(), 10.0, 1000.0;
  return unit.replicate(window.size(), 1);
}

MatX BundleAdjuster::gauge_basis(const Window& window, const VecX& units) {
  MatX n = MatX::Zero(8 * window.size(), window.scale_held() ? 6 : 7);
  for (int i = 0; i < window.size(); ++i) {
    const SE3& T = window[i].frozen_T_camera_world;
    n.block<6, 6>(8 * i, 0) = T.adjoint();
    if (!window.scale_held()) n.block<3, 1>(8 * i, 6) = T.translation();
  }
  n = units.cwiseInverse().asDiagonal() * n;
  return orthonormalized(n);
}

MatX BundleAdjuster::removable_gauge(const Window& window, const VecX& units) {
  if (window[0].id != 0) return gauge_basis(window, units);
  if (window.scale_held()) return MatX::Zero(8 * window.size(), 0);
  // The first keyframe's prior holds the pose: what is left is scale about its camera centre.
  const Vec3 centre = window[0].frozen_T_camera_world.inverse().translation();
  MatX n = MatX::Zero(8 * window.size(), 1);
  for (int i = 1; i < window.size(); ++i) {
    n.block<3, 1>(8 * i, 0) = window[i].frozen_T_camera_world * centre;
  }
  return orthonormalized(units.cwiseInverse().asDiagonal() * n);
}

BundleAdjuster::ReducedSystem BundleAdjuster::reduced(const Window& window,
                                                      const NormalEquations& system,
                                                      double lambda) const {
  MatX H = system.top + window.prior().H;
  VecX b = system.b_top + window.prior().b + window.prior().H * window.stacked_x();
  for (int i = 0; i < window.size(); ++i) {
    const FramePrior p = frame_prior(window[i], config_);
    H.diagonal().segment<8>(8 * i) += p.weight;
    b.segment<8>(8 * i) += p.weight.cwiseProduct(p.error);
  }
  H.diagonal() *= 1.0 + lambda;
  H -= system.schur / (1.0 + lambda);
  b -= system.b_schur / (1.0 + lambda);
  return {std::move(H), std::move(b)};
}

VecX BundleAdjuster::solve(const Window& window, const NormalEquations& system, double lambda,
                           bool remove_gauge) const {
  auto [H, b] = reduced(window, system, lambda);
  const VecX units = state_units(window);
  H = units.asDiagonal() * H * units.asDiagonal();
  b = units.cwiseProduct(b);
  // Where the window holds little but sky in common with an old keyframe, its place is anywhere.
  for (int i = 0; i < window.size(); ++i) {
    H.diagonal().segment<3>(8 * i).array() += config_.place_damping;
  }
  const VecX balance = (H.diagonal().array() + 10.0).sqrt().inverse();
  const MatX balanced = balance.asDiagonal() * H * balance.asDiagonal();
  VecX y = -balance.cwiseProduct(solve_symmetric(balanced, balance.cwiseProduct(b)));
  if (remove_gauge) {
    const MatX basis = removable_gauge(window, units);
    if (basis.cols() > 0) y -= basis * (basis.transpose() * y);
  }
  return units.cwiseProduct(y);
}

bool BundleAdjuster::apply_step(const VecX& dx, double lambda, Window* window) {
  problem_.step_depths(now_, dx, lambda);
  const int n = window->size();
  Vec4 sums = Vec4::Zero();  // squared: a, b, rotation, translation
  for (int i = 0; i < n; ++i) {
    const Vec8 d = dx.segment<8>(8 * i);
    sums +=
        Vec4(d[6] * d[6], d[7] * d[7], d.segment<3>(3).squaredNorm(), d.head<3>().squaredNorm());
    (*window)[i].set_x((*window)[i].x + d);
  }
  window->update_geometry();
  const Vec4 rms = (sums / n).cwiseSqrt();
  const double s = config_.stop_threshold;
  return rms[0] < 5e-3 * s && rms[1] < 0.05 * s && rms[2] < 5e-5 * s &&
         rms[3] * window->mean_inverse_depth() < 2.5e-5 * s;
}

void BundleAdjuster::drop_bad_residuals(Window* window) const {
  const auto newest = static_cast<std::size_t>(window->newest().slot);
  for (int h = 0; h < window->size(); ++h) {
    for (Point& p : (*window)[h].points) {
      if (p.residuals[newest].state != ResidualState::kAbsent) {
        p.last_but_one_state = p.last_state;
        p.last_state = p.residuals[newest].state;
      }
      if (p.static_state != ResidualState::kIn) p.static_state = ResidualState::kAbsent;
      for (int t = 0; t < window->size(); ++t) {
        Residual& r = p.residuals[static_cast<std::size_t>((*window)[t].slot)];
        if (r.state == ResidualState::kIn) {
          ++p.good_residuals;
          const double baseline = window->pair(h, t).distance * p.rho;
          p.relative_baseline = std::max(p.relative_baseline, static_cast<float>(baseline));
        } else if (r.state != ResidualState::kAbsent) {
          r = Residual();
        }
      }
    }
  }
}

MatX BundleAdjuster::covariance_beside(const Window& window, MatX H, int anchor,
                                       const std::vector<Eigen::Index>& wanted) {
  const VecX units = state_units(window);
  H = units.asDiagonal() * H * units.asDiagonal();
  // The scale of the world about the anchor; the pose of that is left out below.
  const Vec3 centre = window[anchor].T_world_camera().translation();
  VecX scale = VecX::Zero(H.rows());
  for (int i = 0; i < window.size(); ++i) {
    const Vec3 moved = window[i].T_camera_world * centre;
    scale.segment<3>(8 * i) = moved.cwiseQuotient(units.segment<3>(8 * i));
  }
  if (const double squared = scale.squaredNorm(); squared > 0.0) {
    const double held = H.diagonal().segment<8>(8 * (window.size() - 1)).maxCoeff();
    for (Eigen::Index i = 0; i < H.rows(); ++i) H.col(i) += held * scale[i] / squared * scale;
  }
  std::vector<Eigen::Index> free;
  free.reserve(static_cast<std::size_t>(H.rows()));
  for (Eigen::Index i = 0; i < H.rows(); ++i) {
    if (i < 8 * anchor || i >= 8 * anchor + 6) free.push_back(i);
  }
  const auto row = [&](Eigen::Index state) { return state < 8 * anchor ? state : state - 6; };
  const auto n = static_cast<Eigen::Index>(wanted.size());
  MatX columns = MatX::Zero(H.rows() - 6, n);
  for (Eigen::Index k = 0; k < n; ++k) columns(row(wanted[static_cast<std::size_t>(k)]), k) = 1.0;
  const MatX solved = solve_symmetric_columns(H(free, free), columns);
  MatX out(n, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Eigen::Index state = wanted[static_cast<std::size_t>(k)];
    out.row(k) = units[state] * solved.row(row(state));
  }
  for (Eigen::Index k = 0; k < n; ++k) out.col(k) *= units[wanted[static_cast<std::size_t>(k)]];
  return out;
}

Mat6 BundleAdjuster::newest_covariance(const Window& window, const NormalEquations& system) const {
  return newest_covariance(window, reduced(window, system, 0.0).H);
}

std::vector<double> BundleAdjuster::place_information(const Window& window,
                                                      const NormalEquations& system) const {
  return place_information(window, reduced(window, system, 0.0).H);
}

Mat6 BundleAdjuster::newest_covariance(const Window& window, const MatX& H) {
  const int newest = window.size() - 1;
  if (newest < 1) return Mat6::Zero();
  std::vector<Eigen::Index> pose(6);
  std::iota(pose.begin(), pose.end(), Eigen::Index{8} * newest);
  const Mat6 covariance = covariance_beside(window, H, newest - 1, pose);
  const bool usable = covariance.allFinite() && covariance.diagonal().minCoeff() > 0.0;
  return usable ? Mat6(0.5 * (covariance + covariance.transpose())) : Mat6(Mat6::Zero());
}

std::vector<double> BundleAdjuster::place_information(const Window& window, MatX H) const {
  const int newest = window.size() - 1;
  // That the first keyframe is the world tells nothing of where the newest one is from it.
  const FramePrior first = frame_prior(window[0], config_);
  H.diagonal().head<6>() -= first.weight.head<6>();
  std::vector<Eigen::Index> places;
  places.reserve(static_cast<std::size_t>(3 * newest));
  for (Eigen::Index i = 0; i < newest; ++i) {
    for (Eigen::Index k = 0; k < 3; ++k) places.push_back(8 * i + k);
  }
  const VecX variances = covariance_beside(window, std::move(H), newest, places).diagonal();
  std::vector<double> out;
  out.reserve(static_cast<std::size_t>(newest));
  for (Eigen::Index i = 0; i < newest; ++i) {
    const double variance = variances.segment<3>(3 * i).sum();
    const bool usable = std::isfinite(variance) && variance > 0.0;
    out.push_back(usable ? 1.0 / variance : 0.0);
  }
  return out;
}

void BundleAdjuster::hold_world(const std::vector<SE3>& before, const MatX& H,
                                Window* window) const {
  // A step without gauge moves all keyframes by their share of what the newest one needs: what
  // tracking errs alike each time would drive the world along. The map's first keyframe is the
  // world; later, little may be seen of the oldest one, and the world must not shake with it.
  const int held = (*window)[0].id == 0 ? 0 : window->steadiest(before);
  window->hold(held, before[static_cast<std::size_t>(held)]);
  if (window->size() < 3) return;
  // Old keyframes that share only what is far with the new ones go their own way, metres a step,
  // and would take along what is published.
  const int placed = window->steadiest_place(before, place_information(*window, H));
  const SO3 turn = (*window)[placed].T_world_camera().rotation();
  window->hold(placed, SE3(turn, before[static_cast<std::size_t>(placed)].translation()));
}

BundleAdjuster::ScaleInformation BundleAdjuster::scale_information(
    const WindowLinearization& at, const std::vector<PointRef>& points) {
  ScaleInformation out;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (at.statics[i].state != ResidualState::kIn) continue;
    const double rho = points[i].point->rho;
    const auto hessian = static_cast<double>(at.statics[i].depth.hessian);
    out.information += hessian * rho * rho;
    out.of_offset += hessian * rho;
  }
  return out;
}

void BundleAdjuster::tell_scale(const Window& window, double noise, BundleResult* result) const {
  // Static residuals weigh more than their noise would have it, and those of a keyframe share the
  // errors of its right image.
  constexpr double kSharedRight = 1.6;
  const auto [information, of_offset] = scale_information(now_, problem_.points());
  if (information <= 0.0 || window.static_scale_free()) return;
  result->scale_variance = config_.static_weight * kSharedRight * noise / information;
  const double rho_per_px = 1.0 / (window.rig()->right.fx * window.rig()->baseline());
  result->scale_per_px = rho_per_px * of_offset / information;
}

void BundleAdjuster::refine_static_scale(Window* window) {
  constexpr double kLargestStep = 0.1;  // of its logarithm
  problem_.linearize(now_, {.system = false, .targets = 0}, &now_);
  const std::vector<PointRef>& points = problem_.points();
  double gradient = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (now_.statics[i].state != ResidualState::kIn) continue;
    gradient += points[i].point->rho * static_cast<double>(now_.statics[i].depth.gradient);
  }
  const double information = scale_information(now_, points).information;
  if (information <= 0.0) return;
  const double step = std::clamp(-gradient / information, -kLargestStep, kLargestStep);
  window->rescale_statics(std::exp(step));
}

bool BundleAdjuster::tells_lens(const Window& window) const {
  // What is told where no two keyframes turn so far would not count, and takes time.
  return config_.lens_every > 0 && window.size() > 2 &&
         window.newest().id % config_.lens_every == 0 && widest_turn(window) >= kLeastLensTurn;
}

std::optional<LensEvidence> BundleAdjuster::lens_evidence(const Window& window) {
  // The last step may have been taken back, or have been too small for another linearization.
  problem_.linearize(now_, {.statics = false}, &next_);
  LensEquations equations(window);
  problem_.visit_inliers(next_, [&](const PointRef& ref, double depth_damping,
                                    std::span<const TargetResidual> inliers) {
    equations.add(ref.host, *ref.point, depth_damping, inliers);
  });
  return equations.evidence(next_.system);
}

NormalEquations BundleAdjuster::iterate(Window* window, BundleResult* result) {
  NormalEquations solved;
  double energy = now_.energy + prior_energy(*window);
  double lambda = config_.damping;
  const int max_iterations = window->size() < 4 ? 15 : config_.max_iterations;
  for (int i = 0; i < max_iterations; ++i) {
    solved = now_.system;
    const VecX dx = solve(*window, solved, lambda, i >= 2);
    if (!dx.allFinite()) {
      result->finite = false;
      return solved;
    }
    backup_.take(*window, problem_.points());
    const bool small = apply_step(dx, lambda, window);
    ++result->iterations;
    const bool converged = small && i + 1 >= config_.min_iterations;
    // Moves nothing by more than some hundredths of a pixel: not worth another linearization.
    if (converged && lambda <= config_.damping) break;
    const bool last = converged || i + 1 == max_iterations;
    problem_.linearize(now_, {.system = !last}, &next_);
    const double new_energy = next_.energy + prior_energy(*window);
    if (new_energy < energy) {
      energy = new_energy;
      std::swap(now_, next_);
      lambda = std::max(config_.damping, lambda * 0.25);
    } else {
      backup_.restore(window, problem_.points());
      lambda *= 100.0;
    }
    if (last) break;
  }
  return solved;
}

BundleResult BundleAdjuster::optimize(Window* window) {
  BundleResult result;
  if (window->rig() != nullptr) {
    for (int i = 0; i < window->size(); ++i) {
      refine_right_brightness(*window->rig(), config_, window->static_scale(), &(*window)[i]);
    }
  }
  problem_.pose(collect_points(window), window);
  window->update_geometry();
  problem_.stored(&now_);
  const auto newest = static_cast<unsigned>(window->size() - 1);
  problem_.linearize(now_, {.system = false, .statics = false, .targets = 1U << newest}, &now_);
  update_outlier_threshold(now_, window);
  if (window->static_scale_free()) refine_static_scale(window);
  problem_.linearize(now_, {}, &now_);
  const std::vector<SE3> before = window->poses();
  const NormalEquations solved = iterate(window, &result);
  if (!result.finite) return result;
  if (tells_lens(*window)) result.lens = lens_evidence(*window);

  window->newest().freeze();
  const MatX H = reduced(*window, solved, 0.0).H;
  hold_world(before, H, window);
  update_outlier_threshold(now_, window);
  problem_.reclassify(&now_);
  problem_.write_back(now_);
  double energy = 0.0;
  for (const StoredResidual& r : now_.residuals) {
    if (r.state != ResidualState::kIn) continue;
    energy += static_cast<double>(r.energy);
    ++result.residuals;
  }
  result.points = static_cast<int>(problem_.points().size());
  result.rmse = std::sqrt(energy / std::max(1, kPatternSize * result.residuals));
  result.finite = std::isfinite(result.rmse);
  result.gradient_scatter = problem_.gradient_scatter(now_, static_cast<int>(newest));
  const double noise = keyframe_variance(result.rmse, result.gradient_scatter);
  result.newest_covariance = noise * newest_covariance(*window, H);
  tell_scale(*window, noise, &result);
  if (result.lens) result.lens->weigh(1.0 / std::max(result.rmse * result.rmse, 1.0));
  drop_bad_residuals(window);
  return result;
}

}  // namespace sovo
