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
constexpr int kAcrossLevel = 2;        ///< Where displacement across the epipolar curve is taken.
constexpr double kEdgeOfRange = 0.02;  ///< Of the search, in log-scale.

/// Gauss-Newton from the level of the start to level 0.
bool descend(const ScaleOptimizerConfig& config, int coarsest_level, ScaleAlignment* alignment,
             ScaleEstimate* out) {
  for (int level = coarsest_level; level >= 0; --level) {
    if (level == coarsest_level || level == 0) alignment->find_occlusions(out->log_scale);
    alignment->set_level(level);
    const double stop = level == 0 ? config.stop_step : 1e-3 * (1 << level);
    if (!alignment->minimize(stop, &out->log_scale, &out->iterations)) return false;
    if (level == std::min(kAcrossLevel, coarsest_level)) {
      out->epipolar_px = alignment->displacement_across();
    }
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

ScaleEstimate estimate_robust_scale(const ScaleOptimizerConfig& config,
                                    const RightProjection& projection,
                                    const KeyframeSnapshot& keyframe, const ImagePyramid& right,
                                    bool cold_start, ScaleWorkspace* workspace) {
  ScaleEstimate out;
  const int top = std::min(keyframe.pyramid->num_levels(), right.num_levels()) - 1;
  ScaleAlignment alignment(config, projection, *keyframe.pyramid, right, workspace);
  int level = std::min(config.tracking_level, top);
  if (cold_start) {
    const int coarsest = std::min(config.cold_level, top);
    const ScaleSearch found = search_scale(config, workspace->points.size, coarsest, &alignment);
    if (!found.found) return out;
    out.log_scale = found.sigma;
    out.ambiguity = found.ambiguity;
    out.iterations = found.iterations;
    level = std::min(level, coarsest);
    alignment.restart();
  }
  const bool aligned = descend(config, level, &alignment, &out);
  out.num_points = alignment.used();
  out.gain = static_cast<double>(alignment.brightness().gain);
  out.bias = static_cast<double>(alignment.brightness().bias);
  out.verdict = observability(config, alignment, workspace->points.size);
  if (!aligned && out.verdict == ScaleVerdict::kAccepted) out.verdict = ScaleVerdict::kUnobservable;
  if (out.verdict != ScaleVerdict::kAccepted) return out;
  const ScaleSums sums = alignment.sums();
  out.sigma = std::sqrt(alignment.variance());
  out.residual = alignment.residual();
  out.inlier_ratio = sums.inliers / sums.count;
  out.verdict = judge(config, out, cold_start);
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
      workspace_(std::make_unique<ScaleWorkspace>()) {}

ScaleOptimizer::~ScaleOptimizer() = default;
ScaleOptimizer::ScaleOptimizer(ScaleOptimizer&& other) noexcept = default;
ScaleOptimizer& ScaleOptimizer::operator=(ScaleOptimizer&& other) noexcept = default;

ScaleEstimate ScaleOptimizer::estimate(const KeyframeSnapshot& keyframe, const ImagePyramid& right,
                                       bool cold_start) const {
  ScaleEstimate out;
  if (right.num_levels() == 0) {
    out.verdict = ScaleVerdict::kNoRightImage;
    return out;
  }
  workspace_->points.prepare(keyframe, rig_, config_.min_relative_sigma);
  if (workspace_->points.size < config_.min_points || keyframe.pyramid == nullptr) return out;
  if (rig_.baseline() < kMinBaseline) {
    out.verdict = ScaleVerdict::kUnobservable;
    return out;
  }
  if (config_.method == ScaleMethod::kPaper) {
    return estimate_paper_scale(config_, rig_, keyframe, right, cold_start, workspace_.get());
  }
  return estimate_robust_scale(config_, *projection_, keyframe, right, cold_start,
                               workspace_.get());
}

}  // namespace sovo
