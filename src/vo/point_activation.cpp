#include "sovo/vo/point_activation.h"

#include <algorithm>
#include <cmath>

#include "sovo/vo/linearization.h"

namespace sovo {

namespace {

constexpr int kIterations = 3;
constexpr double kStartLambda = 0.1;
constexpr double kStopStep = 1e-4;         // relative
constexpr double kMinInformation = 100.0;  // H_rho_rho * mean_rho^2
constexpr int kCandidateBlock = 32;
constexpr float kNotSelected = -1.0F;

bool is_ready(const ImmaturePoint& p, const PointConfig& config) {
  const bool traced = p.state == TraceState::kGood || p.state == TraceState::kSkipped ||
                      p.state == TraceState::kBadCondition || p.from_static_match;
  return traced && p.state != TraceState::kOutlier && p.state != TraceState::kOutOfView &&
         std::isfinite(p.rho_max) && p.interval_px < static_cast<float>(config.max_interval_px) &&
         p.quality > static_cast<float>(config.min_quality) && p.rho_min + p.rho_max > 0.0F;
}

bool is_dead(const ImmaturePoint& p, bool host_leaves) {
  if (p.state == TraceState::kOutlier) return !p.from_static_match || host_leaves;
  return p.state == TraceState::kOutOfView || host_leaves;
}

}  // namespace

DistanceMap::DistanceMap(int width, int height) : distance_(width / 2, height / 2) {
  distance_.fill(kMaxDistance);
}

void DistanceMap::stamp(float u, float v) {
  constexpr int kRadius = static_cast<int>(kMaxDistance);
  const int cx = static_cast<int>(u);
  const int cy = static_cast<int>(v);
  for (int y = std::max(0, cy - kRadius); y <= std::min(distance_.height() - 1, cy + kRadius);
       ++y) {
    float* row = distance_.row(y);
    const int dy = std::abs(y - cy);
    for (int x = std::max(0, cx - kRadius); x <= std::min(distance_.width() - 1, cx + kRadius);
         ++x) {
      const int dx = std::abs(x - cx);
      // Octagonal norm: close to Euclidean, whole-number arithmetic.
      const float d =
          static_cast<float>(std::max(dx, dy)) + 0.5F * static_cast<float>(std::min(dx, dy));
      row[x] = std::min(row[x], d);
    }
  }
}

float DistanceMap::at(float u, float v) const {
  const int x = static_cast<int>(u);
  const int y = static_cast<int>(v);
  if (x < 1 || y < 1 || x >= distance_.width() - 1 || y >= distance_.height() - 1) {
    return kNotSelected;
  }
  return distance_.at(x, y);
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
  DistanceMap map(image.width(), image.height());
  const auto project = [&](int host, float pu, float pv, float rho, float* u, float* v) {
    const PairGeometry& g = window->pair(host, newest);
    const Eigen::Vector3f p = g.KRKi * Eigen::Vector3f(pu, pv, 1.0F) + g.Kt * rho;
    *u = 0.5F * (p.x() / p.z() + 0.5F) - 0.5F + 0.5F;  // level 1, rounded by truncation
    *v = 0.5F * (p.y() / p.z() + 0.5F) - 0.5F + 0.5F;
    return p.z() > 0.0F && std::isfinite(*u) && std::isfinite(*v) && std::abs(*u) < 1e6F &&
           std::abs(*v) < 1e6F;
  };
  float u = 0.0F;
  float v = 0.0F;
  for (int h = 0; h < newest; ++h) {
    for (const Point& p : (*window)[h].points) {
      if (project(h, p.u, p.v, static_cast<float>(p.rho), &u, &v) && map.at(u, v) >= 0.0F) {
        map.stamp(u, v);
      }
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
      const bool in_front = project(h, p.u, p.v, 0.5F * (p.rho_min + p.rho_max), &u, &v);
      const float distance = in_front ? map.at(u, v) : kNotSelected;
      if (distance < 0.0F) {
        chosen.push_back({h, i, std::nullopt, true});
      } else if (distance >= min_distance_ * static_cast<float>(p.type)) {
        map.stamp(u, v);
        chosen.push_back({h, i, std::nullopt, false});
      }
    }
  }
  return chosen;
}

void PointActivator::optimize(const Window& window, Candidate* candidate) const {
  const Keyframe& host = window[candidate->host];
  const ImmaturePoint& immature = host.immature[candidate->index];
  Point p;
  p.u = immature.u;
  p.v = immature.v;
  p.colour = immature.colour;
  p.weight = immature.weight;
  p.type = immature.type;
  p.rho = std::max(0.5 * (static_cast<double>(immature.rho_min) + immature.rho_max), 1e-6);

  const auto evaluate = [&](double slack, double* energy, double* hessian, double* gradient) {
    *energy = *hessian = *gradient = 0.0;
    for (int t = 0; t < window.size(); ++t) {
      if (t == candidate->host) continue;
      Residual& r = p.residuals[static_cast<std::size_t>(window[t].slot)];
      r.state = ResidualState::kIn;
      linearize(window, window_config_, candidate->host, t, p, &r);
      const float threshold = immature.energy_threshold;
      if (r.new_state == ResidualState::kOutOfView) {
        *energy += threshold;
        continue;
      }
      const bool inlier = r.raw_energy < threshold * slack && r.gram[0] + r.gram[4] >= 2.0F;
      r.new_state = inlier ? ResidualState::kIn : ResidualState::kOutlier;
      *energy += inlier ? r.raw_energy : threshold * slack;
      if (inlier) accumulate_depth(r, hessian, gradient);
    }
  };
  double energy, hessian, gradient;
  evaluate(1e3, &energy, &hessian, &gradient);
  const double unit = std::pow(window.mean_inverse_depth(), 2);
  double lambda = kStartLambda;
  if (hessian * unit < kMinInformation) return;  // stays immature
  double best_rho = p.rho;
  evaluate(1.0, &energy, &hessian, &gradient);
  for (int it = 0; it < kIterations && hessian * unit >= kMinInformation; ++it) {
    const double step = gradient / (hessian * (1.0 + lambda));
    p.rho = best_rho - step;
    double new_energy, new_hessian, new_gradient;
    evaluate(1.0, &new_energy, &new_hessian, &new_gradient);
    if (new_energy < energy) {
      best_rho = p.rho;
      energy = new_energy;
      hessian = new_hessian;
      gradient = new_gradient;
      lambda *= 0.5;
    } else {
      lambda *= 5.0;
    }
    if (std::abs(step) < kStopStep * best_rho) break;
  }
  p.rho = best_rho;
  evaluate(1.0, &energy, &hessian, &gradient);
  p.hessian = hessian;
  int inliers = 0;
  for (int t = 0; t < window.size(); ++t) {
    Residual& r = p.residuals[static_cast<std::size_t>(window[t].slot)];
    if (t == candidate->host || r.new_state != ResidualState::kIn) {
      r = Residual();
      continue;
    }
    r.state = ResidualState::kIn;
    r.energy = r.raw_energy;
    ++inliers;
  }
  candidate->discard = true;  // the immature point goes, as an active one or for good
  if (inliers == 0 || !std::isfinite(p.rho) || p.rho <= 0.0) return;
  p.last_state =
      p.residuals[static_cast<std::size_t>(window.newest().slot)].state == ResidualState::kIn
          ? ResidualState::kIn
          : ResidualState::kOutOfView;
  candidate->point = p;
}

int PointActivator::activate(Window* window) {
  adapt_spacing(window->num_active_points());
  std::vector<Candidate> candidates = choose(window);
  const int total = static_cast<int>(candidates.size());
  pool_->run((total + kCandidateBlock - 1) / kCandidateBlock, [&](int block) {
    for (int i = block * kCandidateBlock; i < std::min(total, (block + 1) * kCandidateBlock); ++i) {
      Candidate& c = candidates[static_cast<std::size_t>(i)];
      if (!c.discard) optimize(*window, &c);
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
