#include "sovo/scale/scale_optimizer.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sovo/scale/paper_scale.h"
#include "sovo/scale/right_projection.h"
#include "sovo/scale/scale_alignment.h"
#include "sovo/scale/scale_search.h"

namespace sovo {

namespace {

constexpr double kMinBaseline = 1e-6;  ///< [m]
constexpr int kCoarseLevel = 2;        ///< Where a turn of a few pixels is still seen as one.
constexpr int kSparsePoints = 600;     ///< Of the finer grid of a cold start.
constexpr int kTurnIterations = 5;     ///< A pyramid level.
constexpr double kFarTurnPx = 0.7;     ///< Of the right camera, beyond which one step is too long.
constexpr double kLargestTurn = 0.1;   ///< [rad]
constexpr double kEdgeOfRange = 0.02;  ///< Of the search, in log-scale.

/// Gauss-Newton from the level of the start to level 0. `coarse`: how the right camera is turned,
/// as a coarse level sees it.
bool descend(const ScaleOptimizerConfig& config, int coarsest_level, ScaleAlignment* alignment,
             ScaleEstimate* out, Vec3* coarse) {
  for (int level = coarsest_level; level >= 0; --level) {
    if (level == coarsest_level || level == 0) alignment->find_occlusions(out->log_scale);
    alignment->set_level(level);
    const double stop = level == 0 ? config.stop_step : 1e-3 * (1 << level);
    if (!alignment->minimize(stop, &out->log_scale, &out->iterations)) return false;
    if (level == std::min(kCoarseLevel, coarsest_level)) *coarse = alignment->turn_step().turn;
  }
  return true;
}

/// Why the points cannot tell the scale; kAccepted where they can.
ScaleVerdict observability(const ScaleOptimizerConfig& config, const ScaleAlignment& alignment,
                           int size) {
  const int needed = std::max(config.min_points, static_cast<int>(config.min_visible * size));
  if (alignment.in_view() < needed) return ScaleVerdict::kTooFewPoints;
  if (alignment.used() < config.min_points) return ScaleVerdict::kUnobservable;
  return ScaleVerdict::kAccepted;
}

ScaleVerdict judge(const ScaleOptimizerConfig& config, const ScaleEstimate& estimate,
                   bool cold_start) {
  const double sigma = estimate.log_scale;
  const bool inside = cold_start ? sigma > config.min_log_scale + kEdgeOfRange &&
                                       sigma < config.max_log_scale - kEdgeOfRange
                                 : std::abs(sigma) < config.tracking_log_range;
  if (!std::isfinite(sigma) || !inside) return ScaleVerdict::kOutOfRange;
  if (estimate.inlier_ratio < config.min_inliers) return ScaleVerdict::kTooFewInliers;
  const double max_sigma = cold_start ? config.max_sigma_cold : config.max_sigma_tracking;
  if (!(estimate.sigma <= max_sigma)) return ScaleVerdict::kUnobservable;
  if (cold_start && estimate.ambiguity > config.ambiguity_ratio) return ScaleVerdict::kAmbiguous;
  return ScaleVerdict::kAccepted;
}

/// What an estimate works with.
struct Task {
  const ScaleOptimizerConfig& config;
  const RightProjection& projection;
  const ImagePyramid& left;
  const ImagePyramid& right;
  ScaleWorkspace* workspace;
  ScaleWorkspace* sparse;
};

/// Start over the whole range; false when nothing can be compared.
bool start_cold(const Task& task, int coarsest_level, ScaleAlignment* alignment,
                ScaleEstimate* out) {
  const ScalePoints& points = task.workspace->points;
  const int stride = std::max(1, points.size / kSparsePoints);
  task.sparse->points.take_every(stride, points);
  ScaleAlignment sparse(task.config, task.projection, task.left, task.right, task.sparse);
  const ScaleSearch found = search_scale(
      task.config, coarsest_level, {points.size, task.sparse->points.size}, &sparse, alignment);
  out->log_scale = found.sigma;
  out->ambiguity = found.ambiguity;
  out->iterations = found.iterations;
  alignment->restart();
  return found.found;
}

/// Log-scale and turn of the right camera together, coarse to fine; false where too few points
/// agree in the end.
bool align_turned(const Task& task, int coarsest_level, double sigma, ScaleAlignment* alignment,
                  TurnStep* out) {
  SO3 turn;
  for (int level = coarsest_level; level >= 0; --level) {
    alignment->set_level(level);
    for (int i = 0; i < kTurnIterations; ++i) {
      alignment->linearize(sigma);
      if (alignment->used() < task.config.min_points) return false;
      alignment->fit_brightness();
      alignment->fit_dispersion(alignment->sums());
      *out = alignment->turn_step();
      sigma += std::clamp(out->log_scale, -task.config.max_step, task.config.max_step);
      task.workspace->points.turn_right(out->turn);
      turn = SO3::exp(out->turn) * turn;
    }
  }
  alignment->linearize(sigma);
  const ScaleSums sums = alignment->sums();
  out->turn = turn.log();
  return sums.inliers >= task.config.min_inliers * sums.count && turn.log().norm() < kLargestTurn;
}

/// By one step from the best scale, or, where that would be long, anew from log-scale `start`.
RightTurnEstimate find_turn(const Task& task, int coarsest_level, double start, double inlier_ratio,
                            const Vec3& coarse, ScaleAlignment* alignment) {
  TurnStep step = alignment->turn_step();
  const double longest = std::max(step.turn.norm(), coarse.norm()) * task.projection.focal();
  const bool far = longest > kFarTurnPx || inlier_ratio < task.config.min_inliers;
  if (far && !align_turned(task, coarsest_level, start, alignment, &step)) return {};
  return {true, step.turn, step.covariance.diagonal().cwiseSqrt(), step.scale_by_turn,
          step.disagreement};
}

ScaleEstimate estimate_robust_scale(const Task& task, bool cold_start) {
  ScaleEstimate out;
  const ScaleOptimizerConfig& config = task.config;
  const int size = task.workspace->points.size;
  const int top = std::min(task.left.num_levels(), task.right.num_levels()) - 1;
  ScaleAlignment alignment(config, task.projection, task.left, task.right, task.workspace);
  const int level = std::min(config.tracking_level, top);
  if (cold_start && !start_cold(task, std::min(config.cold_level, top), &alignment, &out)) {
    return out;
  }
  const double start = out.log_scale;
  Vec3 coarse = Vec3::Zero();
  const bool aligned = descend(config, level, &alignment, &out, &coarse);
  out.num_points = alignment.used();
  out.gain = static_cast<double>(alignment.brightness().gain);
  out.bias = static_cast<double>(alignment.brightness().bias);
  out.verdict = observability(config, alignment, size);
  out.out_of_view = out.verdict == ScaleVerdict::kTooFewPoints && size >= config.min_points;
  if (!aligned && out.verdict == ScaleVerdict::kAccepted) out.verdict = ScaleVerdict::kUnobservable;
  if (out.verdict != ScaleVerdict::kAccepted) return out;
  const ScaleSums sums = alignment.sums();
  out.sigma = std::sqrt(alignment.variance());
  out.residual = alignment.residual();
  out.inlier_ratio = sums.inliers / sums.count;
  out.verdict = judge(config, out, cold_start);
  out.turn = find_turn(task, level, start, out.inlier_ratio, coarse, &alignment);
  return out;
}

}  // namespace

std::string to_string(ScaleVerdict verdict) {
  switch (verdict) {
    case ScaleVerdict::kAccepted:
      return "accepted";
    case ScaleVerdict::kTooFewPoints:
      return "too_few_points";
    case ScaleVerdict::kUnobservable:
      return "unobservable";
    case ScaleVerdict::kAmbiguous:
      return "ambiguous";
    case ScaleVerdict::kTooFewInliers:
      return "too_few_inliers";
    case ScaleVerdict::kOutOfRange:
      return "out_of_range";
    case ScaleVerdict::kInnovation:
      return "innovation";
    case ScaleVerdict::kNoRightImage:
      return "no_right_image";
  }
  return "unknown";
}

ScaleOptimizer::ScaleOptimizer(const ScaleOptimizerConfig& config, const StereoRig& rig)
    : config_(config),
      rig_(rig),
      projection_(std::make_unique<RightProjection>(rig.right)),
      workspace_(std::make_unique<ScaleWorkspace>()),
      sparse_workspace_(std::make_unique<ScaleWorkspace>()) {}

ScaleOptimizer::~ScaleOptimizer() = default;
ScaleOptimizer::ScaleOptimizer(ScaleOptimizer&& other) noexcept = default;
ScaleOptimizer& ScaleOptimizer::operator=(ScaleOptimizer&& other) noexcept = default;

ScaleEstimate ScaleOptimizer::estimate(const KeyframeSnapshot& keyframe, const ImagePyramid& right,
                                       bool cold_start, const SE3& T_later_left,
                                       const SO3& turn) const {
  ScaleEstimate out;
  if (right.num_levels() == 0) {
    out.verdict = ScaleVerdict::kNoRightImage;
    return out;
  }
  const StereoRig rig = rig_.turned(turn);
  workspace_->points.prepare(keyframe, rig, T_later_left, config_.min_relative_sigma);
  if (workspace_->points.size < config_.min_points || keyframe.pyramid == nullptr) return out;
  if (rig_.baseline() < kMinBaseline) {
    out.verdict = ScaleVerdict::kUnobservable;
    return out;
  }
  if (config_.method == ScaleMethod::kPaper) {
    return estimate_paper_scale(config_, rig, keyframe, right, cold_start, workspace_.get());
  }
  const Task task{config_, *projection_,     *keyframe.pyramid,
                  right,   workspace_.get(), sparse_workspace_.get()};
  return estimate_robust_scale(task, cold_start);
}

}  // namespace sovo
