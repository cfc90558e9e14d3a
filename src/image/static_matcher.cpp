#include "sovo/image/static_matcher.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "sovo/image/patch_correlation.h"

namespace sovo {

namespace {

constexpr int kMaxExhaustiveSteps = 40;    ///< Longer ranges are searched one level coarser.
constexpr int kModeDistance = 2;           ///< Modes are more than so many steps apart.
constexpr double kBehindInfinityPx = 1.5;  ///< Noise may move a point at infinity this far.
constexpr float kModeWindow = 0.25F;       ///< Coarse modes this far below the best are dropped.

struct Range {
  double min = 0.0;
  double max = 0.0;
};

/// The right pixel looked for in the left image, by inverse depth of the left frame's z.
std::optional<PatchSearch> backward_search(const StereoRig& rig, const ImagePyramid& left,
                                           const ImagePyramid& right, const Vec2& pixel) {
  const SE3 T_left_right = rig.T_right_left.inverse();
  const Mat3 r = T_left_right.rotation_matrix();
  const auto ray = rig.right.unproject(pixel);
  const auto ray_x = rig.right.unproject(pixel + Vec2(1.0, 0.0));
  const auto ray_y = rig.right.unproject(pixel + Vec2(0.0, 1.0));
  if (!ray || !ray_x || !ray_y) return std::nullopt;
  EpipolarCurve::Mat32 d_infinity;
  d_infinity << r * (*ray_x - *ray), r * (*ray_y - *ray);
  return PatchSearch{&right,
                     &left,
                     pixel,
                     {rig.left, r * *ray, T_left_right * rig.right.ray_offset(*ray), d_infinity}};
}

/// Inverse distance along the right ray of the point that has inverse depth rho in the left
/// frame: 1 / rho = z_left = infinity.z / lambda + slope.z.
double inverse_distance(const EpipolarCurve& backward, double rho) {
  return rho * backward.infinity().z() / (1.0 - rho * backward.slope().z());
}

/// The part of a range whose pixels lie in the target image, and its length in pixels.
struct VisibleRange {
  Range range;
  double length_px = 0.0;
};

std::optional<VisibleRange> clip_to_image(const EpipolarCurve& curve, Range range) {
  constexpr double kStepPx = 24.0;
  constexpr double kBorderPx = 3.0;
  constexpr int kMaxNodes = 200;
  VisibleRange out;
  bool entered = false;
  double rho = range.min;
  double before = rho;
  for (int i = 0; i < kMaxNodes; ++i) {
    const auto point = curve.at(rho);
    if (!point) break;
    const double speed = point->derivative.norm();
    if (curve.target().contains(point->pixel, kBorderPx)) {
      if (!entered) out.range.min = before;
      entered = true;
      out.range.max = rho;
    } else if (entered) {
      out.range.max = rho;
      break;
    }
    if (rho >= range.max || speed < 1e-6) break;
    before = rho;
    rho = std::min(range.max, rho + kStepPx / speed);
    if (entered) out.length_px += (rho - before) * speed;
  }
  if (!entered) return std::nullopt;
  return out;
}

/// Level of the exhaustive search: the finest at which the range is not too long.
int exhaustive_level(double length_px, int coarsest) {
  int level = 0;
  while (level < coarsest && length_px / (1 << level) > kMaxExhaustiveSteps) ++level;
  return level;
}

/// A candidate along the curve, its correlation, and that of the best one elsewhere.
struct Mode {
  double rho = 0.0;
  double score = -1.0;
  double rival = -1.0;
};

Mode mode_of(const CorrelationProfile& profile, int step) {
  Mode mode{static_cast<double>(profile.refined_rho(step)),
            static_cast<double>(profile.score[step]), -1.0};
  const int other = profile.best_other_mode(step, kModeDistance);
  if (other >= 0) mode.rival = static_cast<double>(profile.score[other]);
  return mode;
}

/// Follows a mode of level `from` down to level 0. There the search goes as far around it as the
/// coarse levels may have mistaken one period of a texture for the next.
std::optional<Mode> refine(const PatchSearch& search, double rho, int from,
                           CorrelationProfile* profile) {
  Mode mode{rho, -1.0, -1.0};
  for (int level = from - 1; level >= 0; --level) {
    const auto point = search.curve.at(mode.rho);
    if (!point) return std::nullopt;
    const double reach_px = level > 0 ? 2.0 * (1 << level) : std::max(3.0, 1.5 * (1 << from));
    const double reach = reach_px / point->derivative.norm();
    const bool fits = correlate(search, level, mode.rho - reach, mode.rho + reach, profile);
    const int best = fits ? profile->best() : -1;
    if (best >= 0) {
      mode = mode_of(*profile, best);
    } else if (level == 0) {
      return std::nullopt;
    }  // else too near the border for this level: the next one may fit
  }
  return mode;
}

/// The best candidate of the whole range.
struct Found {
  Mode mode;
  int level = 0;  ///< Where the search was exhaustive.
};

std::optional<Found> search_range(const PatchSearch& search, const VisibleRange& visible,
                                  int coarsest, CorrelationProfile* profile) {
  int level = exhaustive_level(visible.length_px, coarsest);
  while (!correlate(search, level, visible.range.min, visible.range.max, profile)) {
    if (--level < 0) return std::nullopt;  // near the border only finer levels have room
  }
  const int best = profile->best();
  if (best < 0) return std::nullopt;
  const Mode first = mode_of(*profile, best);
  if (level == 0) return Found{first, 0};
  const int other = profile->best_other_mode(best, kModeDistance);
  const bool close = other >= 0 && profile->score[other] > profile->score[best] - kModeWindow;
  const double other_rho = close ? static_cast<double>(profile->refined_rho(other)) : 0.0;
  auto winner = refine(search, first.rho, level, profile);
  auto loser = close ? refine(search, other_rho, level, profile) : std::nullopt;
  if (loser && (!winner || loser->score > winner->score)) std::swap(winner, loser);
  if (!winner) return std::nullopt;
  if (loser) {
    const auto point = search.curve.at(winner->rho);
    const double apart_px = std::abs(winner->rho - loser->rho) * point->derivative.norm();
    if (apart_px > kModeDistance) winner->rival = std::max(winner->rival, loser->score);
  }
  return Found{*winner, level};
}

/// The best of the range at a level, when that is near `expected`; `expected` itself where the
/// patch does not fit into the image at this level.
std::optional<double> best_near(const PatchSearch& search, const Range& range, double expected,
                                int level, CorrelationProfile* profile) {
  const auto visible = clip_to_image(search.curve, range);
  const auto point = search.curve.at(expected);
  if (!visible || !point) return std::nullopt;
  if (!correlate(search, level, visible->range.min, visible->range.max, profile)) return expected;
  const int best = profile->best();
  if (best < 0) return std::nullopt;
  const double off = std::abs(static_cast<double>(profile->rho[best]) - expected) *
                     point->derivative.norm() / (1 << level);
  if (off > kModeDistance) return std::nullopt;
  return static_cast<double>(profile->refined_rho(best));
}

/// Whether the right pixel, looked for in the left image over the same range, leads back.
bool leads_back(const PatchSearch& forward, const StereoRig& rig, const Range& range, double rho,
                const Vec2& right_pixel, int level, double max_error_px,
                CorrelationProfile* profile) {
  const auto search = backward_search(rig, *forward.base, *forward.target, right_pixel);
  if (!search) return false;
  const Range back{inverse_distance(search->curve, range.min),
                   inverse_distance(search->curve, range.max)};
  const double expected = inverse_distance(search->curve, rho);
  const auto point = search->curve.at(expected);
  if (!point) return false;
  auto found = best_near(*search, back, expected, level, profile);
  if (found && level > 0) {
    const double reach = 3.0 / point->derivative.norm();
    found = best_near(*search, {expected - reach, expected + reach}, expected, 0, profile);
  }
  if (!found) return false;
  const auto aligned = align(*search, *found, false);
  return aligned && (aligned->pixel - forward.pixel).norm() <= max_error_px;
}

void fill(const Alignment& aligned, const EpipolarCurve& curve, bool clamp, StaticMatch* out) {
  out->inverse_depth = static_cast<float>(clamp ? std::max(0.0, aligned.rho) : aligned.rho);
  out->sigma = static_cast<float>(aligned.sigma_px / aligned.px_per_rho);
  out->zncc = static_cast<float>(aligned.zncc);
  out->across_px = static_cast<float>(aligned.across_px);
  out->across_sigma_px = static_cast<float>(aligned.across_sigma_px);
  if (const auto infinity = curve.at(0.0)) {
    const double length = (aligned.pixel - infinity->pixel).norm();
    out->disparity_px = static_cast<float>(aligned.rho < 0.0 ? -length : length);
  }
}

}  // namespace

StaticMatcher::StaticMatcher(const StaticMatcherConfig& config, const StereoRig& rig)
    : config_(config), rig_(rig) {
  assert(rig.left.is_pinhole());
}

std::pair<float, float> StaticMatcher::whole_range() const {
  const double least = config_.max_depth > 0.0 ? 1.0 / config_.max_depth : 0.0;
  return {static_cast<float>(least), static_cast<float>(1.0 / config_.min_depth)};
}

StaticMatch StaticMatcher::match(const ImagePyramid& left, const ImagePyramid& right, float u,
                                 float v, const MatchRequest& request) const {
  StaticMatch out;
  const Vec2 pixel(u, v);
  const PatchSearch search{&left, &right, pixel, right_curve(rig_, rig_.T_right_left, pixel)};
  const auto [least, greatest] = request.inverse_depth_range.value_or(whole_range());
  Range range{static_cast<double>(least), static_cast<double>(greatest)};
  const bool clamp = range.min >= 0.0;
  const auto farthest = search.curve.at(range.min);
  if (!farthest) return out;
  range.min -= kBehindInfinityPx / farthest->derivative.norm();
  const auto visible = clip_to_image(search.curve, range);
  if (!visible) return out;
  const auto gradient = gradient_along(search, 0.5 * (visible->range.min + visible->range.max));
  if (!gradient) return out;
  out.state = MatchState::kNoTexture;
  if (*gradient < static_cast<double>(request.gradient_share) * config_.min_gradient) return out;

  out.state = MatchState::kOutOfView;
  const int coarsest =
      std::min({config_.coarsest_level, left.num_levels() - 1, right.num_levels() - 1});
  CorrelationProfile profile;
  const auto found = search_range(search, *visible, coarsest, &profile);
  if (!found) return out;

  out.state = MatchState::kLowCorrelation;
  out.zncc = static_cast<float>(found->mode.score);
  const auto aligned = align(search, found->mode.rho, request.across);
  if (!aligned) return out;
  fill(*aligned, search.curve, clamp, &out);
  if (aligned->zncc < config_.min_zncc) return out;
  if (clamp && aligned->rho * aligned->px_per_rho < -3.0 * aligned->sigma_px) return out;
  out.state = MatchState::kAmbiguous;
  if (found->mode.rival > found->mode.score - config_.min_uniqueness) return out;
  out.state = MatchState::kBackCheck;
  if (!leads_back(search, rig_, range, aligned->rho, aligned->pixel, found->level,
                  config_.max_back_error_px, &profile)) {
    return out;
  }
  out.state = MatchState::kMatched;
  return out;
}

}  // namespace sovo
