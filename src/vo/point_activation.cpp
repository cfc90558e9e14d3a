#include "sovo/vo/point_activation.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sovo {

namespace {

constexpr int kIterations = 3;
constexpr double kDepthStartLambda = 0.1;
constexpr double kStopStep = 1e-4;  // relative
constexpr int kCandidateBlock = 32;
constexpr double kComparableSize = 1.5;  // of a pattern, over that in its host

bool is_ready(const ImmaturePoint& p, const PointConfig& config) {
  const bool traced = p.state == TraceState::kGood || p.state == TraceState::kSkipped ||
                      p.state == TraceState::kBadCondition || p.from_static_match();
  return traced && p.state != TraceState::kOutlier && p.state != TraceState::kOutOfView &&
         std::isfinite(p.rho_max) && p.interval_px < static_cast<float>(config.max_interval_px) &&
         p.quality > static_cast<float>(config.min_quality) && p.rho_min + p.rho_max > 0.0F;
}

bool is_dead(const ImmaturePoint& p, bool host_leaves) {
  if (p.state == TraceState::kOutlier) return !p.from_static_match() || host_leaves;
  return p.state == TraceState::kOutOfView || host_leaves;
}

/// Pixel of pyramid level 1 at which a point is seen; nothing when it is not.
struct LevelOnePixel {
  int x = 0, y = 0;
  bool seen = false;
};

LevelOnePixel project(const PairGeometry& g, const OccupancyMap& map, float u, float v, float rho) {
  const Eigen::Vector3f p = g.KRKi * Eigen::Vector3f(u, v, 1.0F) + g.Kt * rho;
  // (p + 0.5) / 2 - 0.5, rounded.
  const float x = 0.5F * (p.x() / p.z() + 0.5F);
  const float y = 0.5F * (p.y() / p.z() + 0.5F);
  // Written so that NaN counts as not seen.
  const bool seen = p.z() > 0.0F && x >= 1.0F && y >= 1.0F &&
                    x < static_cast<float>(map.width() - 1) &&
                    y < static_cast<float>(map.height() - 1);
  if (!seen) return {};
  return {static_cast<int>(x), static_cast<int>(y), true};
}

}  // namespace

OccupancyMap::OccupancyMap(int width, int height)
    : width_(width),
      height_(height),
      words_(static_cast<std::size_t>(width) / 64 + 2),  // one more: rows are read two at a time
      bits_(words_ * static_cast<std::size_t>(height)) {}

void OccupancyMap::take(int x, int y) {
  const auto column = static_cast<std::size_t>(x);
  bits_[static_cast<std::size_t>(y) * words_ + column / 64] |= std::uint64_t{1} << column % 64;
}

bool OccupancyMap::any_in_row(int y, int first_x, int last_x) const {
  const auto first = static_cast<std::size_t>(std::max(0, first_x));
  const auto last = static_cast<std::size_t>(std::min(width_ - 1, last_x));
  if (last < first || last - first > 63) return false;  // the caller asks for neither
  const std::uint64_t* word = &bits_[static_cast<std::size_t>(y) * words_ + first / 64];
  const std::size_t shift = first % 64;
  std::uint64_t bits = word[0] >> shift;
  if (shift > 0) bits |= word[1] << (64 - shift);
  return (bits & ((std::uint64_t{2} << (last - first)) - 1)) != 0;
}

bool OccupancyMap::any_closer(int x, int y, float distance) const {
  const auto octagonal = [](int a, int b) {
    return static_cast<float>(std::max(a, b)) + 0.5F * static_cast<float>(std::min(a, b));
  };
  int reach = static_cast<int>(distance);  // shrinks away from the row
  for (int dy = 0; octagonal(0, dy) < distance; ++dy) {
    while (octagonal(reach, dy) >= distance) --reach;
    if (y - dy >= 0 && any_in_row(y - dy, x - reach, x + reach)) return true;
    if (y + dy < height_ && any_in_row(y + dy, x - reach, x + reach)) return true;
  }
  return false;
}

void PointActivator::adapt_spacing(int active) {
  const double share = static_cast<double>(active) / config_.active_points;
  float change = 0.0F;
  if (share < 0.66) change -= 0.8F;
  if (share < 0.8) change -= 0.3F;
  if (share < 0.9) change -= 0.1F;
  if (share < 1.0) change -= 0.1F;
  if (share > 1.5) change += 0.8F;
  if (share > 1.3) change += 0.5F;
  if (share > 1.15) change += 0.2F;
  if (share > 1.0) change += 0.1F;
  min_distance_ = std::clamp(min_distance_ + change, 0.0F, 4.0F);
}

std::vector<PointActivator::Candidate> PointActivator::choose(Window* window) const {
  const int newest = window->size() - 1;
  const ImageF& image = window->newest().image();
  OccupancyMap map(image.width() / 2, image.height() / 2);
  for (int h = 0; h < newest; ++h) {
    for (const Point& p : (*window)[h].points) {
      const LevelOnePixel at =
          project(window->pair(h, newest), map, p.u, p.v, static_cast<float>(p.rho));
      if (at.seen) map.take(at.x, at.y);
    }
  }
  std::vector<Candidate> chosen;
  for (int h = 0; h < newest; ++h) {
    Keyframe& host = (*window)[h];
    for (std::size_t i = 0; i < host.immature.size(); ++i) {
      const ImmaturePoint& p = host.immature[i];
      if (!is_ready(p, config_)) {
        if (is_dead(p, host.leaving)) chosen.push_back({h, i, std::nullopt, true});
        continue;
      }
      const LevelOnePixel at =
          project(window->pair(h, newest), map, p.u, p.v, 0.5F * (p.rho_min + p.rho_max));
      if (!at.seen) {
        chosen.push_back({h, i, std::nullopt, true});
      } else if (!map.any_closer(at.x, at.y, min_distance_ * static_cast<float>(p.type))) {
        map.take(at.x, at.y);
        chosen.push_back({h, i, std::nullopt, false});
      }
    }
  }
  return chosen;
}

void PointActivator::linearize(const Window& window, const Candidate& candidate, const Point& point,
                               CandidateBlur* blur, DepthEvaluation* out) const {
  const Residual fresh{.state = ResidualState::kIn};
  std::array<PatternProjection, kMaxSlots> projections;
  for (int t = 0; t < window.size(); ++t) {
    if (t == candidate.host) continue;
    PatternProjection& projection = projections[static_cast<std::size_t>(t)];
    project_pattern(window, candidate.host, t, point, &projection);
    prefetch_pattern(window, t, projection);
  }
  for (int t = 0; t < window.size(); ++t) {
    if (t == candidate.host) continue;
    const auto k = static_cast<std::size_t>(t);
    linearize_projected(window, window_config_, candidate.host, t, point, fresh, projections[k],
                        &(*blur)[k], &out->residuals[k]);
  }
}

void PointActivator::judge(const Window& window, const Candidate& candidate, double slack,
                           DepthEvaluation* at) {
  const float threshold = window[candidate.host].immature[candidate.index].energy_threshold;
  at->energy = at->hessian = at->gradient = 0.0;
  for (int t = 0; t < window.size(); ++t) {
    if (t == candidate.host) continue;
    LinearizedResidual& r = at->residuals[static_cast<std::size_t>(t)];
    if (r.state == ResidualState::kOutOfView) {
      at->energy += threshold;
      continue;
    }
    const bool inlier = r.raw_energy < threshold * slack && is_textured(r);
    r.state = inlier ? ResidualState::kIn : ResidualState::kOutlier;
    at->energy += inlier ? r.raw_energy : threshold * slack;
    if (inlier) {
      const DepthPart part = depth_part(r);
      at->hessian += static_cast<double>(part.hessian);
      at->gradient += static_cast<double>(part.gradient);
    }
  }
}

/// A keyframe that sees the point far larger or smaller than its host does not deny it: on most
/// surfaces the pattern looks different there.
PointActivator::Votes PointActivator::count_votes(const Window& window, int host, double rho,
                                                  const DepthEvaluation& at) {
  Votes votes;
  for (int t = 0; t < window.size(); ++t) {
    if (t == host) continue;
    const LinearizedResidual& r = at.residuals[static_cast<std::size_t>(t)];
    if (r.state == ResidualState::kIn) ++votes.agree;
    const double size = static_cast<double>(r.centre_rho) / rho;
    const bool comparable = size < kComparableSize && size * kComparableSize > 1.0;
    if (r.state == ResidualState::kOutlier && comparable) ++votes.deny;
  }
  return votes;
}

void PointActivator::optimize(const Window& window, double mean_rho, Candidate* candidate) const {
  const Keyframe& host = window[candidate->host];
  const ImmaturePoint& immature = host.immature[candidate->index];
  Point p = point_of(immature);
  p.rho = std::max(0.5 * (static_cast<double>(immature.rho_min) + immature.rho_max), 1e-6);
  p.static_information = immature.static_information;
  p.slope = immature.slope;

  CandidateBlur blur;
  DepthEvaluation now;
  linearize(window, *candidate, p, &blur, &now);
  judge(window, *candidate, 1e3, &now);
  const double unit = mean_rho * mean_rho;
  double lambda = kDepthStartLambda;
  // A camera that turns on the spot shows no parallax, and yet needs points: those of stereo.
  const bool known = knows_depth(static_cast<double>(p.static_information), p.rho);
  if (now.hessian * unit < kMinRelativeInformation && !known) return;  // stays immature
  double best_rho = p.rho;
  judge(window, *candidate, 1.0, &now);
  DepthEvaluation next;
  for (int it = 0; it < kIterations && now.hessian * unit >= kMinRelativeInformation; ++it) {
    const double step = now.gradient / (now.hessian * (1.0 + lambda));
    p.rho = best_rho - step;
    linearize(window, *candidate, p, &blur, &next);
    judge(window, *candidate, 1.0, &next);
    if (next.energy < now.energy) {
      best_rho = p.rho;
      std::swap(now, next);
      lambda *= 0.5;
    } else {
      lambda *= 5.0;
    }
    if (std::abs(step) < kStopStep * best_rho) break;
  }
  p.rho = best_rho;
  p.hessian = now.hessian;
  for (int t = 0; t < window.size(); ++t) {
    const LinearizedResidual& r = now.residuals[static_cast<std::size_t>(t)];
    if (t == candidate->host || r.state != ResidualState::kIn) continue;
    p.residuals[static_cast<std::size_t>(window[t].slot)] = {ResidualState::kIn, r.raw_energy,
                                                             r.centre_u, r.centre_v, r.centre_rho};
  }
  if (host.right) p.static_state = ResidualState::kIn;
  candidate->discard = true;  // the immature point goes, as an active one or for good
  // What most keyframes deny moves by itself, a car ahead: stereo knows its depth, the map has no
  // place for it.
  const Votes votes = count_votes(window, candidate->host, p.rho, now);
  if (votes.agree == 0 || votes.agree < votes.deny) return;
  if (!std::isfinite(p.rho) || p.rho <= 0.0) return;
  p.last_state =
      p.residuals[static_cast<std::size_t>(window.newest().slot)].state == ResidualState::kIn
          ? ResidualState::kIn
          : ResidualState::kOutOfView;
  candidate->point = p;
}

int PointActivator::activate(Window* window) {
  adapt_spacing(window->num_active_points());
  std::vector<Candidate> candidates = choose(window);
  const double mean_rho = window->mean_inverse_depth();
  const int total = static_cast<int>(candidates.size());
  pool_->run((total + kCandidateBlock - 1) / kCandidateBlock, [&](int block) {
    for (int i = block * kCandidateBlock; i < std::min(total, (block + 1) * kCandidateBlock); ++i) {
      Candidate& c = candidates[static_cast<std::size_t>(i)];
      if (!c.discard) optimize(*window, mean_rho, &c);
    }
  });
  int activated = 0;
  for (Candidate& c : candidates) {
    Keyframe& host = (*window)[c.host];
    if (c.point) {
      host.points.push_back(*c.point);
      ++host.points_hosted;
      ++activated;
    }
    if (c.discard) host.immature[c.index].type = 0;  // marks it for removal below
  }
  for (int h = 0; h < window->size(); ++h) {
    // In raster order neighbours in memory are neighbours in every target image.
    std::stable_sort(
        (*window)[h].points.begin(), (*window)[h].points.end(),
        [](const Point& a, const Point& b) { return a.v < b.v || (a.v == b.v && a.u < b.u); });
    std::erase_if((*window)[h].immature, [](const ImmaturePoint& p) { return p.type == 0; });
  }
  return activated;
}

}  // namespace sovo
