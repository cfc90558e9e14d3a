#include "sovo/vo/keyframe_policy.h"

#include <algorithm>
#include <cmath>

namespace sovo {

namespace {

constexpr int kManyGood = 14;  // good residuals on record of a long-seen point
constexpr int kFewLeft = 3;
constexpr double kNextFrame = 1.5;  // of the time between two frames
constexpr double kFitsWell = 0.85;  // share of what is tracked that agrees

/// Sum over the other keyframes of 1 / distance, times the root of the distance to the newest;
/// distances in mean depths.
double distance_score(const Window& window, double mean_rho, int i) {
  double sum = 0.0;
  for (int j = 0; j < window.size() - 1; ++j) {
    if (j == i) continue;
    const double d = window.pair(i, j).distance * mean_rho;
    sum += 1.0 / (d + 1e-5);
  }
  const double to_newest = window.pair(i, window.size() - 1).distance * mean_rho;
  return std::sqrt(to_newest) * sum;
}

bool should_leave(const Window& window, const Point& p, int residuals, int surviving) {
  if (residuals == 0 || p.rho <= 0.0) return true;
  if (p.last_state == ResidualState::kOutOfView) return true;
  if (p.last_state == ResidualState::kOutlier && p.last_but_one_state == ResidualState::kOutlier) {
    return true;
  }
  return window.size() > 2 && p.good_residuals > kManyGood && surviving < kFewLeft;
}

}  // namespace

double pixels_for_one_of_vga(const CameraModel& camera) {
  return (camera.width + camera.height) / (640.0 + 480.0);
}

double motion_score(const KeyframeConfig& config, const CameraModel& camera,
                    const PointMotion& motion) {
  const double unit = 1.0 / pixels_for_one_of_vga(camera);
  return config.flow_translation * unit * motion.flow_translation +
         config.flow_total * unit * motion.flow_total + config.approach * motion.approach;
}

bool wants_keyframe(const KeyframeConfig& config, const CameraModel& camera,
                    const TrackingReference& reference, const TrackingResult& tracked,
                    const PointMotion& motion, double exposure_s, const TrackedHistory& history) {
  const BrightnessTransfer transfer =
      brightness_transfer(reference.affine, reference.exposure_s, tracked.affine, exposure_s);
  const double moved = motion_score(config, camera, motion);
  // All that is tracked against a blurred keyframe suffers, so a sharp one is waited for while the
  // next frame will still be near and fit. Blur takes contrast, which says nothing of the light.
  const double next_score = moved * (1.0 + 1.0 / history.frames);
  const bool fits = tracked.inlier_ratio > config.blurred_min_inlier_ratio;
  if (history.blurred && fits && next_score < config.blurred_max_score) return false;
  const double brightness = config.brightness * std::abs(std::log(transfer.gain));
  const double score = moved + brightness;
  // The residual of a camera at rest is noise, and twice of it nothing that a keyframe would mend:
  // without parallax the window's scale would be left to that noise.
  const bool fits_badly =
      tracked.rmse > config.rmse_factor * history.first_rmse && score > config.rmse_min_score;
  // Between every frame and every other one a little more motion would double the keyframes, and
  // one that is twice as far away is as good, where the map is whole and what is tracked fits.
  const bool may_wait =
      history.frames < kNextFrame && !history.young && tracked.inlier_ratio > kFitsWell;
  const double wanted = may_wait ? std::max(1.0, config.next_frame_score) : 1.0;
  return moved / wanted + brightness > 1.0 || fits_badly;
}

void mark_leaving_keyframes(const KeyframeConfig& config, Window* window) {
  const int n = window->size();
  int leaving = 0;
  for (int i = 0; i < n; ++i) {
    Keyframe& k = (*window)[i];
    k.leaving = false;
    if (i == n - 1) continue;
    const double left = static_cast<double>(k.points.size() + k.immature.size());
    const double gone = static_cast<double>(k.points_gone);
    const BrightnessTransfer transfer = brightness_transfer(
        k.affine, k.exposure_s, window->newest().affine, window->newest().exposure_s);
    const bool few = left < config.min_points_left * (left + gone);
    const bool bright = std::abs(std::log(transfer.gain)) > config.max_brightness;
    if ((few || bright) && n - leaving > config.min_keyframes) {
      k.leaving = true;
      ++leaving;
    }
  }
  if (n - leaving < config.max_keyframes) return;
  const double mean_rho = window->mean_inverse_depth();
  double best = -1.0;
  int best_index = -1;
  for (int i = 0; i < n - 1; ++i) {
    if ((*window)[i].leaving || (*window)[i].id == 0) continue;
    const double score = distance_score(*window, mean_rho, i);
    if (score > best) {
      best = score;
      best_index = i;
    }
  }
  if (best_index >= 0) (*window)[best_index].leaving = true;
}

LeavingPoints mark_leaving_points(const WindowConfig& config, Window* window) {
  LeavingPoints out;
  const double unit = std::pow(window->mean_inverse_depth(), 2);
  for (int h = 0; h < window->size(); ++h) {
    Keyframe& host = (*window)[h];
    for (Point& p : host.points) {
      int residuals = 0;
      int surviving = 0;
      for (int t = 0; t < window->size(); ++t) {
        const Residual& r = p.residuals[static_cast<std::size_t>((*window)[t].slot)];
        if (r.state == ResidualState::kAbsent) continue;
        ++residuals;
        if (!(*window)[t].leaving) ++surviving;
      }
      if (!host.leaving && !should_leave(*window, p, residuals, surviving)) continue;
      p.remove = true;
      const bool informative = residuals >= config.min_good_residuals &&
                               p.good_residuals > config.min_good_residuals && p.rho > 0.0 &&
                               p.hessian * unit > config.min_relative_information;
      if (informative) {
        out.marginalize.push_back({h, &p});
      } else {
        ++out.dropped;
      }
    }
  }
  return out;
}

void erase_marked_points(Window* window) {
  for (int h = 0; h < window->size(); ++h) {
    Keyframe& host = (*window)[h];
    const std::size_t before = host.points.size();
    std::erase_if(host.points, [](const Point& p) { return p.remove; });
    host.points_gone += static_cast<int>(before - host.points.size());
  }
}

}  // namespace sovo
