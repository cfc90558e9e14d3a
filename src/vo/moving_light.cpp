#include "sovo/vo/moving_light.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace sovo {

namespace {

constexpr double kForgetLight = 0.9;    ///< A keyframe.
constexpr double kForgetJudged = 0.85;  ///< A keyframe.
constexpr int kLearnFirst = 2;          ///< Keyframes.
constexpr double kLightPrior = 0.1;     ///< On each term, of which most are about one.
constexpr std::size_t kFewestInPair = 20;
constexpr std::size_t kFewestInAll = 100;
constexpr double kDarkestGrey = 8.0;      ///< Grey levels between which logarithms
constexpr double kBrightestGrey = 248.0;  ///< are compared.
constexpr double kLeastScatter = 0.003;
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

double take_median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

bool has_enough(const std::vector<LightSight>& pair) { return pair.size() >= kFewestInPair; }

/// Of the pairs that have enough.
std::size_t count_sights(const std::vector<std::vector<LightSight>>& pairs) {
  std::size_t count = 0;
  for (const auto& pair : pairs) count += has_enough(pair) ? pair.size() : 0;
  return count;
}

/// What `light` leaves of the logarithms, about the median of each pair that has enough.
std::vector<double> left_by(const Vec6& light, const std::vector<std::vector<LightSight>>& pairs) {
  std::vector<double> left;
  left.reserve(count_sights(pairs));
  std::vector<double> of_pair;
  for (const auto& pair : pairs) {
    if (!has_enough(pair)) continue;
    of_pair.clear();
    of_pair.reserve(pair.size());
    for (const LightSight& s : pair) of_pair.push_back(s.log_ratio - light.dot(s.terms));
    const double middle = take_median(of_pair);
    for (const double e : of_pair) left.push_back(e - middle);
  }
  return left;
}

double scatter_of(std::vector<double> errors) {
  for (double& e : errors) e = std::abs(e);
  return std::max(1.48 * take_median(std::move(errors)), kLeastScatter);
}

}  // namespace

bool MovingLight::found() const {
  const std::lock_guard lock(mutex_);
  return found_;
}

void MovingLight::observe(const CameraModel& camera, const PointSights& seen) {
  Pairs pairs;
  pairs.reserve(seen.size());
  for (const auto& of_host : seen) {
    std::vector<LightSight>& pair = pairs.emplace_back();
    pair.reserve(of_host.size());
    for (const PointSight& s : of_host) {
      if (is_clear(s.grey) && is_clear(s.grey_host) && s.depth_ratio > 0.0) {
        pair.push_back(light_sight(camera, s));
      }
    }
  }
  observe(pairs);
}

void MovingLight::observe(const std::vector<std::vector<LightSight>>& pairs) {
  if (count_sights(pairs) < kFewestInAll) return;
  if (learned_ >= kLearnFirst) judge(pairs);
  learn(pairs);
}

void MovingLight::judge(const Pairs& pairs) {
  const double before = scatter_of(left_by(Vec6::Zero(), pairs));
  const double after = scatter_of(left_by(light_, pairs));
  judged_ = kForgetJudged * judged_ + 1.0;
  log_left_ = kForgetJudged * log_left_ + std::log(after / before);
  log_scatter_ = kForgetJudged * log_scatter_ + std::log(before);
  if (learned_ + 1 < kLearnFirst + config_.keyframes) return;
  const std::lock_guard lock(mutex_);
  found_ = found_ || (std::exp(log_left_ / judged_) < config_.most_left &&
                      std::exp(log_scatter_ / judged_) > config_.least_scatter);
}

/// The brightness of each pair is eliminated.
void MovingLight::learn(const Pairs& pairs) {
  const std::vector<double> errors = left_by(light_, pairs);
  const double sigma = scatter_of(errors);
  H_ *= kForgetLight;
  g_ *= kForgetLight;
  std::size_t i = 0;
  for (const auto& pair : pairs) {
    if (!has_enough(pair)) continue;
    double sum = 0.0, ratio = 0.0;
    Vec6 mean = Vec6::Zero(), product = Vec6::Zero();
    Mat6 square = Mat6::Zero();
    for (const LightSight& s : pair) {
      const double e = std::abs(errors[i++]);
      const double w = std::min(1.0, kLightHuber * sigma / std::max(e, sigma)) / (sigma * sigma);
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
