#include "sovo/vo/exposure_estimate.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <optional>

#include "sovo/vo/linearization.h"

namespace sovo {

namespace {

constexpr std::size_t kEvery = 8;       ///< Points; a hundred or two tell enough.
constexpr int kObserveAlways = 10;      ///< Keyframes; after them every
constexpr int kObserveSeldom = 5;       ///< fifth one.
constexpr double kTellingTime = 0.01;   ///< A keyframe tells of an exposure when so long a one
constexpr double kTellingStreak = 4.0;  ///< would leave a streak of this length [px].
constexpr double kClearly = 0.95;       ///< Of the energy with the velocity that was expected.
constexpr double kForget = 0.9;         ///< A keyframe: light changes, and exposures with it.

/// What the newest keyframe shows decides how much of its velocity it had while it was exposed: all
/// of it, half, or none; or it is taken for not known, and no pattern is made up for.
void choose_velocity(const WindowConfig& config, double unknown_s, double nearest, Window* window) {
  Keyframe& newest = window->newest();
  const std::array<std::optional<Vec6>, 4> candidates = {
      *newest.velocity, Vec6(0.5 * *newest.velocity), Vec6(Vec6::Zero()), std::nullopt};
  std::optional<Vec6> best;
  double least = std::numeric_limits<double>::infinity();
  for (const std::optional<Vec6>& candidate : candidates) {
    newest.velocity = candidate;
    window->set_exposures(unknown_s, nearest);
    // The first one, which others have to beat clearly, is what the frames before tell.
    const double energy = energy_into_newest(config, *window);
    const bool is_first = least == std::numeric_limits<double>::infinity();
    if (is_first || energy < least) {
      least = is_first ? kClearly * energy : energy;
      best = candidate;
    }
  }
  newest.velocity = best;
  window->set_exposures(unknown_s, nearest);
}

}  // namespace

double energy_into_newest(const WindowConfig& config, const Window& window) {
  const int target = window.size() - 1;
  const auto slot = static_cast<std::size_t>(window.newest().slot);
  double energy = 0.0;
  for (int host = 0; host < target; ++host) {
    const std::vector<Point>& points = window[host].points;
    for (std::size_t i = 0; i < points.size(); i += kEvery) {
      const Residual& known = points[i].residuals[slot];
      if (known.state == ResidualState::kAbsent || known.state == ResidualState::kOutOfView) {
        continue;
      }
      LinearizedResidual r;
      linearize(window, config, host, target, points[i], known, &r);
      if (r.state != ResidualState::kOutOfView) energy += static_cast<double>(r.energy);
    }
  }
  return energy;
}

bool ExposureEstimate::is_due(double nearest, Window* window) {
  const Keyframe& newest = window->newest();
  if (newest.exposure_s > 0.0 || config_.least_share <= 0.0) return false;
  window->set_exposures(kTellingTime, nearest);
  if (newest.longest_streak < kTellingStreak) return false;
  ++observed_;
  return observed_ <= kObserveAlways || observed_ % kObserveSeldom == 0;
}

void ExposureEstimate::observe(const WindowConfig& config, double nearest, Window* window) {
  for (std::size_t i = 0; i < kTimes.size(); ++i) {
    window->set_exposures(kTimes[i], nearest);
    energies_[i] = kForget * energies_[i] + energy_into_newest(config, *window);
  }
  const auto least = std::min_element(energies_.begin(), energies_.end());
  const bool is_less = *least < config_.least_share * energies_[0];
  seconds_ = is_less ? kTimes[static_cast<std::size_t>(least - energies_.begin())] : 0.0;
}

void ExposureEstimate::settle(const WindowConfig& config, Window* window) {
  Keyframe& newest = window->newest();
  if (!newest.velocity) return;
  const double nearest = window->nearest_inverse_depth();
  if (is_due(nearest, window)) observe(config, nearest, window);
  window->set_exposures(seconds_, nearest);
  if (newest.longest_streak >= static_cast<double>(kVisibleStreak)) {
    choose_velocity(config, seconds_, nearest, window);
  }
}

}  // namespace sovo
