#include "sovo/vo/coarse_tracker.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "sovo/geometry/linear_solvers.h"
#include "sovo/vo/moments.h"

namespace sovo {

namespace {

constexpr std::array<int, 6> kMaxIterations = {10, 20, 50, 50, 50, 50};
constexpr int kRankIterations = 12;  ///< Enough to tell a good start from a bad one.
constexpr double kStartLambda = 0.01;
constexpr double kMinRejectLambda = 0.001;
constexpr double kExtrapolationLimit = 0.001;
constexpr double kStopNorm = 1e-3;
constexpr double kMaxSaturated = 0.6;
constexpr double kMaxCutoffFactor = 64.0;
constexpr double kLevelRejectFactor = 1.5;
/// More change of log-gain explains no image but an unrelated one, by taking its contrast away.
constexpr double kMaxLogGain = 1.5;

/// A motion and how badly it explains an image: RMSE over the root of the share of inliers.
struct Ranked {
  double score = 0.0;
  SE3 T;
};
constexpr double kExplainsNothing = 1e9;
constexpr std::size_t kFavourites = 4;    ///< Motions looked at again for each that is kept.
constexpr double kSamePixels = 0.5;       ///< Motions that end closer on a level are the same.
constexpr std::size_t kMostAligned = 64;  ///< Of more, those are that explain most as they are.
constexpr std::size_t kRankPoints = 500;  ///< Of a level: enough to compare motions, of thousands.

constexpr int kFinestLevels = 2;  ///< Where a point has no neighbours that help it.

int num_levels(const TrackingReference& reference, const ImagePyramid& pyramid) {
  return std::min(static_cast<int>(reference.levels.size()), pyramid.num_levels());
}

/// A motion that moves the points out of view explains nothing.
double badness(double rmse, int inliers, std::size_t points) {
  const double share = static_cast<double>(inliers) / static_cast<double>(points);
  return share > 0.0 ? rmse / std::sqrt(share) : kExplainsNothing;
}

void sort_best_first(std::vector<Ranked>* ranked) {
  std::erase_if(*ranked, [](const Ranked& r) { return !(r.score < kExplainsNothing); });
  std::stable_sort(ranked->begin(), ranked->end(),
                   [](const Ranked& a, const Ranked& b) { return a.score < b.score; });
}

/// Those of `sorted` that are not what a better one is already: apart by more than `apart`, an
/// angle and a share of the mean depth.
std::vector<Ranked> distinct(const std::vector<Ranked>& sorted, double apart, double mean_rho,
                             std::size_t most) {
  std::vector<Ranked> out;
  for (const Ranked& r : sorted) {
    const bool known = std::any_of(out.begin(), out.end(), [&](const Ranked& better) {
      const SE3 difference = r.T * better.T.inverse();
      return difference.rotation().log().norm() < apart &&
             difference.translation().norm() * mean_rho < apart;
    });
    if (!known) out.push_back(r);
    if (out.size() == most) break;
  }
  return out;
}

/// Every n-th point, so that less than twice `most` are left.
ReferenceLevel thinned(const ReferenceLevel& all, std::size_t most) {
  const std::size_t stride = std::max<std::size_t>(1, all.size() / most);
  ReferenceLevel out;
  out.camera = all.camera;
  for (std::size_t i = 0; i < all.size(); i += stride) {
    out.u.push_back(all.u[i]);
    out.v.push_back(all.v[i]);
    out.rho.push_back(all.rho[i]);
    out.colour.push_back(all.colour[i]);
    out.weight.push_back(all.weight[i]);
  }
  return out;
}

RobustNorm norm_for(const TrackerConfig& config, const TrackingReference& reference) {
  return {reference.threshold_share * config.huber, reference.threshold_share * config.cutoff};
}

/// Prior on a frame's brightness: that of the reference.
struct BrightnessPrior {
  Vec8 weight = Vec8::Zero();
  Affine mean;

  BrightnessPrior(const TrackerConfig& config, const Affine& reference) : mean(reference) {
    weight[6] = config.brightness_prior_a;
    weight[7] = config.brightness_prior_b;
  }
  Vec8 error(const Affine& a) const {
    Vec8 error = Vec8::Zero();
    error[6] = a.a - mean.a;
    error[7] = a.b - mean.b;
    return error;
  }
  Vec8 gradient(const Affine& a) const { return weight.cwiseProduct(error(a)); }
  double energy(const Affine& a, int in_view) const {
    return weight.dot(error(a).cwiseAbs2()) / std::max(1, in_view);
  }
};

/// Levenberg-Marquardt step in states divided by `units`; a small damping extrapolates it.
Vec8 damped_step(Mat8 H, const Vec8& gradient, const Vec8& prior, const Vec8& units,
                 double lambda) {
  H.diagonal() += prior;
  H = units.asDiagonal() * H * units.asDiagonal();
  H.diagonal() *= 1.0 + lambda;
  Vec8 step = -solve_small(H, units.cwiseProduct(gradient));
  if (lambda < kExtrapolationLimit) step *= std::sqrt(std::sqrt(kExtrapolationLimit / lambda));
  if (!step.allFinite()) step.setZero();
  return step;
}

/// A scene that hides much of itself has fewer inliers from frame to frame, always; a wrong pose
/// has fewer than the frame before.
double expected_inlier_ratio(const TrackerConfig& config, const LastTracking& last) {
  constexpr double kSteady = 0.1;
  constexpr double kLeast = 0.65;
  const double steady = std::max(last.inlier_ratio - kSteady, kLeast);
  return std::min(steady, config.sure_inlier_ratio);
}

/// The frame fits as well as the last one did, or, where the image became blurred or the last fit
/// was exceptional, so well that no wrong pose does.
bool is_as_expected(const TrackerConfig& config, const LastTracking& last,
                    const TrackingResult& found) {
  if (!(last.rmse > 0.0)) return false;
  return (found.rmse < config.lost_rmse_factor * last.rmse &&
          found.inlier_ratio > expected_inlier_ratio(config, last)) ||
         (found.correlation > config.sure_correlation &&
          found.inlier_ratio > config.sure_inlier_ratio);
}

/// What fits by chance lies anywhere: a pose to which the motion led needs less to be believed.
double least_correlation(const TrackerConfig& config, const LastTracking& last,
                         const TrackingResult& found, double mean_rho) {
  constexpr double kTurn = 0.02;   // [rad]
  constexpr double kShift = 0.02;  // mean depths
  if (found.inlier_ratio <= config.min_inlier_ratio) return config.few_inliers_correlation;
  if (!last.expected) return config.min_correlation;
  const SE3 off = found.T_current_reference * last.expected->inverse();
  const bool on_way =
      off.rotation().log().norm() < kTurn && off.translation().norm() * mean_rho < kShift;
  return on_way ? config.min_correlation_on_way : config.min_correlation;
}

/// Of reference and image, by the weights of the residuals; 0 where either does not vary.
double correlation_of_agreeing(const WarpedPoints& points, const BrightnessTransfer& transfer) {
  Moments moments;
  for (std::size_t i = 0; i < points.n; ++i) {
    const double a = points.colour[i];
    moments.add_weighted(points.weight[i], a,
                         transfer.gain * a + transfer.bias + points.residual[i]);
  }
  return moments.correlation();
}

/// Units that make the eight unknowns comparable in the stop test.
Vec8 tracker_units(double mean_rho) {
  Vec8 s;
  s << Vec3::Constant(0.5 / mean_rho), Vec3::Ones(), 10.0, 1000.0;
  return s;
}

}  // namespace

void WarpedPoints::reserve(std::size_t size) {
  for (auto* v : {&x, &y, &rho, &gx, &gy, &residual, &weight, &colour}) {
    if (v->size() < size) v->resize(size);
  }
}

double CoarseTracker::residuals(const ReferenceLevel& level, const ImageF& image, const SE3& T,
                                const BrightnessTransfer& transfer, const RobustNorm& norm,
                                Linearization* out) {
  warped_.reserve(level.size() + kTrackedGroup);
  ResidualSums sums;
  run_kernel<ResidualPass>(
      TrackedPoints{level, image, Warp(level.camera, T)},
      ResidualConfig{static_cast<float>(transfer.gain), static_cast<float>(transfer.bias),
                     static_cast<float>(norm.huber), static_cast<float>(norm.cutoff)},
      warped_.arrays(), &sums);
  warped_.n = sums.n;
  out->in_view = sums.in_view;
  out->inliers = sums.inliers;
  out->saturated = out->in_view > 0 ? 1.0 - static_cast<double>(out->inliers) / out->in_view : 1.0;
  out->energy = out->in_view > 0 ? sums.energy / out->in_view : 1e10;
  return out->energy;
}

void CoarseTracker::compare(const ReferenceLevel& level, const ImageF& image,
                            TrackingResult* result) {
  const TrackedPoints points{level, image, Warp(level.camera, result->T_current_reference)};
  const Lane zero = lane_of(0.0F);
  Moments moments;
  for (std::size_t i = 0; i < level.size(); i += kLanes) {
    Projected<Lane> p;
    project(points, i, &p);
    const LaneSample s = sample_lanes_with_gradient(image, p.offset, p.fx, p.fy);
    const Lane x = p.in_view ? p.colour : zero;
    const Lane y = p.in_view ? s.value : zero;
    const Lane one = p.in_view ? lane_of(1.0F) : zero;
    const Lane g = p.in_view ? Lane(s.gx * s.gx + s.gy * s.gy) : zero;
    for (std::size_t k = 0; k < kLanes; ++k) moments.add(one[k], x[k], y[k], g[k]);
  }
  result->correlation = moments.correlation();
  result->sharpness = moments.sharpness();
}

void CoarseTracker::normal_equations(const BrightnessTransfer& transfer, double reference_b,
                                     Linearization* out) {
  std::array<double, kGram> total{};
  run_kernel<GramOfInliers>(
      warped_.arrays(), warped_.n,
      BrightnessJacobian{static_cast<float>(transfer.gain), static_cast<float>(reference_b)},
      total.data());
  std::size_t k = 0;
  for (Eigen::Index i = 0; i < 9; ++i) {
    for (Eigen::Index j = i; j < 9; ++j, ++k) {
      if (i < 8 && j < 8) {
        out->H(i, j) = total[k];
        out->H(j, i) = total[k];
      } else if (i < 8) {
        out->b[i] = total[k];
      }
    }
  }
}

CoarseTracker::Fit CoarseTracker::fit(const TrackingReference& reference, const ImageF& image,
                                      const SE3& T, const BrightnessTransfer& transfer) {
  Linearization out;
  residuals(reference.levels[0], image, T, transfer, norm_for(config_, reference), &out);
  return {out.saturated, correlation_of_agreeing(warped_, transfer), out.energy};
}

double CoarseTracker::unexplained(const TrackingReference& reference, const ReferenceLevel& points,
                                  const ImageF& image, double exposure_s, TrackingResult pose) {
  Linearization out;
  const double energy = residuals(
      points, image, pose.T_current_reference,
      brightness_transfer(reference.affine, reference.exposure_s, pose.affine, exposure_s),
      norm_for(config_, reference), &out);
  compare(points, image, &pose);
  return std::sqrt(energy) / std::max(pose.correlation * pose.correlation, 1e-6);
}

CoarseTracker::Linearization CoarseTracker::linearize(const TrackingReference& reference, int level,
                                                      const ImageF& image, const SE3& T,
                                                      const BrightnessTransfer& transfer,
                                                      const RobustNorm& norm) {
  Linearization out;
  residuals(reference.levels[static_cast<std::size_t>(level)], image, T, transfer, norm, &out);
  normal_equations(transfer, reference.affine.b, &out);
  return out;
}

CoarseTracker::LevelOutcome CoarseTracker::align_level(const TrackingReference& reference,
                                                       int level, const ImageF& image,
                                                       double exposure_s, RobustNorm* norm, SE3* T,
                                                       Affine* affine, int max_iterations) {
  const ReferenceLevel& points = reference.levels[static_cast<std::size_t>(level)];
  const auto transfer_of = [&](const Affine& a) {
    return brightness_transfer(reference.affine, reference.exposure_s, a, exposure_s);
  };
  const Vec8 units = tracker_units(reference.mean_rho);
  const BrightnessPrior prior(config_, reference.affine);

  LevelOutcome out;
  Linearization now;
  residuals(points, image, *T, transfer_of(*affine), *norm, &now);
  while (now.saturated > kMaxSaturated && norm->cutoff < config_.cutoff * kMaxCutoffFactor) {
    norm->cutoff *= 2.0;
    residuals(points, image, *T, transfer_of(*affine), *norm, &now);
  }
  normal_equations(transfer_of(*affine), reference.affine.b, &now);
  double energy = now.energy + prior.energy(*affine, now.in_view);

  double lambda = kStartLambda;
  bool accepted = false;
  for (int it = 0; it < max_iterations; ++it) {
    const Vec8 gradient = now.b + prior.gradient(*affine);
    const Vec8 step = damped_step(now.H, gradient, prior.weight, units, lambda);
    const Vec8 x = units.cwiseProduct(step);
    const bool converged = !(step.norm() > kStopNorm);

    const SE3 new_T = SE3::exp(x.head<6>()) * *T;
    const Affine new_affine{affine->a + x[6], affine->b + x[7]};
    if (converged && accepted) {  // moves too little to be measured
      *T = new_T;
      *affine = new_affine;
      break;
    }
    Linearization next;
    residuals(points, image, new_T, transfer_of(new_affine), *norm, &next);
    const double new_energy = next.energy + prior.energy(new_affine, next.in_view);
    accepted = new_energy < energy;
    if (accepted) {
      normal_equations(transfer_of(new_affine), reference.affine.b, &next);
      now = next;
      energy = new_energy;
      *T = new_T;
      *affine = new_affine;
      lambda *= 0.5;
    } else {
      lambda = std::max(lambda * 4.0, kMinRejectLambda);
    }
    if (converged) break;
  }
  out.last = now;
  out.rmse = std::sqrt(now.energy);
  out.finite = std::isfinite(out.rmse) && now.in_view > 0;
  return out;
}

TrackingResult CoarseTracker::try_hypothesis(const TrackingReference& reference,
                                             const ImagePyramid& pyramid, double exposure_s,
                                             const Affine& guess, const SE3& start, int levels) {
  TrackingResult result;
  result.T_current_reference = start;
  result.affine = guess;
  const RobustNorm usual = norm_for(config_, reference);
  bool repeated = false;
  LevelOutcome outcome;
  for (int l = levels - 1; l >= 0; --l) {
    RobustNorm norm = usual;
    outcome =
        align_level(reference, l, pyramid.level(l), exposure_s, &norm, &result.T_current_reference,
                    &result.affine, kMaxIterations[static_cast<std::size_t>(std::min(l, 5))]);
    double& best = best_rmse_[static_cast<std::size_t>(l)];
    if (!outcome.finite || outcome.rmse > kLevelRejectFactor * best) return result;
    if (norm.cutoff > usual.cutoff && !repeated) {
      repeated = true;
      ++l;
      continue;
    }
    best = std::min(best, outcome.rmse);
  }
  const Linearization& last = outcome.last;
  result.rmse = outcome.rmse;
  result.inliers = last.inliers;
  result.inlier_ratio = 1.0 - last.saturated;
  result.view_ratio = static_cast<double>(last.in_view) /
                      static_cast<double>(std::max<std::size_t>(1, reference.levels[0].size()));
  result.information = last.H.topLeftCorner<6, 6>();
  result.good = last.in_view >= 30 && std::abs(result.affine.a - reference.affine.a) < kMaxLogGain;
  return result;
}

void CoarseTracker::compare_with_last(const TrackingReference& reference,
                                      const ImagePyramid& pyramid, const LastTracking& last,
                                      TrackingResult* result) const {
  compare(reference.levels[0], pyramid.level(0), result);
  result->as_expected = is_as_expected(config_, last, *result);
}

bool CoarseTracker::is_believed(const TrackingReference& reference, const LastTracking& last,
                                const TrackingResult& found) const {
  // Among weak texture it is a vehicle's own body, or its shadow, that correlates.
  const double least_ratio =
      reference.threshold_share < 1.0 ? config_.min_inlier_ratio : config_.least_inlier_ratio;
  return found.good && found.rmse < config_.max_rmse && found.inlier_ratio > least_ratio &&
         found.correlation > least_correlation(config_, last, found, reference.mean_rho);
}

TrackingResult CoarseTracker::refine(const TrackingReference& reference,
                                     const ImagePyramid& pyramid, double exposure_s,
                                     const Affine& affine_guess, const SE3& start,
                                     const LastTracking& last) {
  best_rmse_.assign(reference.levels.size(), 1e10);
  const int levels = std::min(kFinestLevels, num_levels(reference, pyramid));
  TrackingResult out = try_hypothesis(reference, pyramid, exposure_s, affine_guess, start, levels);
  if (out.good) compare_with_last(reference, pyramid, last, &out);
  out.good = is_believed(reference, last, out);
  return out;
}

TrackingResult CoarseTracker::track(const TrackingReference& reference, const ImagePyramid& pyramid,
                                    double exposure_s, const Affine& affine_guess,
                                    std::span<const SE3> hypotheses, const LastTracking& last) {
  best_rmse_.assign(reference.levels.size(), 1e10);
  TrackingResult best;
  for (std::size_t i = 0; i < hypotheses.size(); ++i) {
    TrackingResult tried = try_hypothesis(reference, pyramid, exposure_s, affine_guess,
                                          hypotheses[i], num_levels(reference, pyramid));
    tried.hypothesis = static_cast<int>(i);
    if (!tried.good || (best.good && tried.rmse >= best.rmse)) continue;
    best = tried;
    compare_with_last(reference, pyramid, last, &best);
    if (best.as_expected) break;
  }
  best.good = is_believed(reference, last, best);
  return best;
}

double CoarseTracker::score_as_it_is(const TrackingReference& reference, int level,
                                     const ImageF& image, double exposure_s, const Affine& affine,
                                     const SE3& T) {
  const ReferenceLevel& points = reference.levels[static_cast<std::size_t>(level)];
  const BrightnessTransfer transfer =
      brightness_transfer(reference.affine, reference.exposure_s, affine, exposure_s);
  Linearization at;
  const double energy = residuals(points, image, T, transfer, norm_for(config_, reference), &at);
  return badness(std::sqrt(energy), at.inliers, points.size());
}

double CoarseTracker::score_aligned(const TrackingReference& reference, int level,
                                    const ImageF& image, double exposure_s, Affine affine, SE3* T) {
  RobustNorm norm = norm_for(config_, reference);
  const LevelOutcome o =
      align_level(reference, level, image, exposure_s, &norm, T, &affine, kRankIterations);
  if (!o.finite) return kExplainsNothing;
  return badness(o.rmse, o.last.inliers, reference.levels[static_cast<std::size_t>(level)].size());
}

std::vector<SE3> CoarseTracker::likeliest(const TrackingReference& reference,
                                          const ImagePyramid& pyramid, double exposure_s,
                                          const Affine& affine_guess, std::span<const SE3> motions,
                                          std::size_t keep) {
  const int level = std::min(1, num_levels(reference, pyramid) - 1);
  const BrightnessTransfer transfer =
      brightness_transfer(reference.affine, reference.exposure_s, affine_guess, exposure_s);
  std::vector<Ranked> ranked;
  for (const SE3& T : motions) {
    Linearization at;
    ranked.push_back(
        {residuals(reference.levels[static_cast<std::size_t>(level)], pyramid.level(level), T,
                   transfer, norm_for(config_, reference), &at),
         T});
  }
  sort_best_first(&ranked);
  if (ranked.size() > keep) ranked.resize(keep);
  std::vector<SE3> out;
  for (const Ranked& r : ranked) out.push_back(r.T);
  return out;
}

std::vector<SE3> CoarseTracker::rank(const TrackingReference& reference,
                                     const ImagePyramid& pyramid, double exposure_s,
                                     const Affine& affine_guess, std::span<const SE3> hypotheses,
                                     std::size_t keep) {
  const int coarsest = num_levels(reference, pyramid) - 1;
  std::vector<Ranked> ranked;
  for (const SE3& start : hypotheses) ranked.push_back({0.0, start});
  TrackingReference few = reference;
  for (int l = coarsest; l >= std::max(0, coarsest - 1); --l) {
    ReferenceLevel& level = few.levels[static_cast<std::size_t>(l)];
    level = thinned(level, kRankPoints);
    const ImageF& image = pyramid.level(l);
    if (ranked.size() > kMostAligned) {
      for (Ranked& r : ranked) {
        r.score = score_as_it_is(few, l, image, exposure_s, affine_guess, r.T);
      }
      sort_best_first(&ranked);
      if (ranked.size() > kMostAligned) ranked.resize(kMostAligned);
    }
    for (Ranked& r : ranked) {
      r.score = score_aligned(few, l, image, exposure_s, affine_guess, &r.T);
    }
    // The coarsest level is the cheapest judge; the next one decides among its favourites.
    sort_best_first(&ranked);
    ranked = distinct(ranked, kSamePixels / level.camera.fx, reference.mean_rho,
                      l == coarsest ? kFavourites * keep : keep);
  }
  std::vector<SE3> out;
  for (const Ranked& r : ranked) out.push_back(r.T);
  return out;
}

}  // namespace sovo
