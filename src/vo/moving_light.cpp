#include "sovo/vo/moving_light.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "sovo/vo/median.h"

namespace sovo {

namespace {

constexpr double kForgetLight = 0.8;    ///< A keyframe.
constexpr double kForgetJudged = 0.85;  ///< A keyframe.
constexpr int kLearnFirst = 2;          ///< Keyframes.
constexpr double kLightPrior = 1e-4;    ///< On each term, of which most are about one.
constexpr std::size_t kFewestInPair = 20;
constexpr std::size_t kFewestInAll = 100;
constexpr double kDarkestGrey = 8.0;      ///< Grey levels between which logarithms
constexpr double kBrightestGrey = 248.0;  ///< are compared.
constexpr double kLeastLightScatter = 0.003;
constexpr double kLightHuber = 1.345;  ///< Standard deviations.

bool is_clear(double grey) { return grey > kDarkestGrey && grey < kBrightestGrey; }

LightSight light_sight(const CameraModel& camera, const PointSight& s) {
  const auto x = [&](double u) { return (u - camera.cx) / camera.width; };
  const auto y = [&](double v) { return (v - camera.cy) / camera.width; };
  const Vec2 a(x(s.u_host), y(s.v_host));
  const Vec2 b(x(s.u), y(s.v));
  LightSight sight;
  sight.terms << -std::log(s.depth_ratio), b.x() - a.x(), b.y() - a.y(),
      b.x() * b.x() - a.x() * a.x(), b.x() * b.y() - a.x() * a.y(), b.y() * b.y() - a.y() * a.y();
  sight.log_ratio = std::log(s.grey / s.grey_host);
  return sight;
}

/// Lamps light what is near, or what is in the middle of the image.
bool is_of_lamps(const Vec6& light) {
  constexpr double kLeastExponent = 0.5;  // of the distance
  return light[0] > kLeastExponent || light[3] + light[5] < 0.0;
}

bool has_enough(const std::vector<LightSight>& pair) { return pair.size() >= kFewestInPair; }

/// Of the pairs that have enough.
std::size_t count_sights(const std::vector<std::vector<LightSight>>& pairs) {
  std::size_t count = 0;
  for (const auto& pair : pairs) count += has_enough(pair) ? pair.size() : 0;
  return count;
}

}  // namespace

bool MovingLight::found() const {
  const std::lock_guard lock(mutex_);
  return found_;
}

void MovingLight::observe(const CameraModel& camera, const PointSights& seen) {
  pairs_.resize(seen.size());
  for (std::size_t i = 0; i < seen.size(); ++i) {
    pairs_[i].clear();
    pairs_[i].reserve(seen[i].size());
    for (const PointSight& s : seen[i]) {
      if (is_clear(s.grey) && is_clear(s.grey_host) && s.depth_ratio > 0.0) {
        pairs_[i].push_back(light_sight(camera, s));
      }
    }
  }
  observe(pairs_);
}

void MovingLight::observe(const std::vector<std::vector<LightSight>>& pairs) {
  if (count_sights(pairs) < kFewestInAll) return;
  if (learned_ >= kLearnFirst) judge(pairs);
  learn(pairs);
}

void MovingLight::find_left(const Vec6& light, const Pairs& pairs) {
  left_.clear();
  left_.reserve(count_sights(pairs));
  for (const auto& pair : pairs) {
    if (!has_enough(pair)) continue;
    of_pair_.clear();
    of_pair_.reserve(pair.size());
    for (const LightSight& s : pair) of_pair_.push_back(s.log_ratio - light.dot(s.terms));
    const double middle = median(of_pair_, &scratch_);
    for (const double e : of_pair_) left_.push_back(std::abs(e - middle));
  }
}

double MovingLight::scatter() {
  return std::max(1.48 * median(left_, &scratch_), kLeastLightScatter);
}

void MovingLight::judge(const Pairs& pairs) {
  find_left(Vec6::Zero(), pairs);
  const double before = scatter();
  find_left(light_, pairs);
  const double after = scatter();
  judged_ = kForgetJudged * judged_ + 1.0;
  log_left_ = kForgetJudged * log_left_ + std::log(after / before);
  log_scatter_ = kForgetJudged * log_scatter_ + std::log(before);
  if (learned_ + 1 < kLearnFirst + config_.keyframes) return;
  const double scattered = std::exp(log_scatter_ / judged_);
  const double most =
      scattered > config_.strong_scatter ? config_.most_left_strong : config_.most_left;
  const bool lit = std::exp(log_left_ / judged_) < most && scattered > config_.least_scatter &&
                   is_of_lamps(light_);
  const std::lock_guard lock(mutex_);
  found_ = found_ || lit;
}

/// The brightness of each pair is eliminated. Keyframes weigh alike: those by daylight, which have
/// a tenth of the scatter, would outvote dozens of those in the dark into which one dives.
void MovingLight::learn(const Pairs& pairs) {
  find_left(light_, pairs);
  const double sigma = scatter();
  H_ *= kForgetLight;
  g_ *= kForgetLight;
  std::size_t i = 0;
  for (const auto& pair : pairs) {
    if (!has_enough(pair)) continue;
    double sum = 0.0, ratio = 0.0;
    Vec6 mean = Vec6::Zero(), product = Vec6::Zero();
    Mat6 square = Mat6::Zero();
    for (const LightSight& s : pair) {
      const double w = kLightHuber * sigma / std::max(left_[i++], kLightHuber * sigma);
      sum += w;
      ratio += w * s.log_ratio;
      mean += w * s.terms;
      product += w * s.log_ratio * s.terms;
      square += w * s.terms * s.terms.transpose();
    }
    H_ += square - mean * mean.transpose() / sum;
    g_ += product - mean * ratio / sum;
  }
  light_ = (H_ + kLightPrior * Mat6::Identity()).ldlt().solve(g_);
  ++learned_;
}

}  // namespace sovo
