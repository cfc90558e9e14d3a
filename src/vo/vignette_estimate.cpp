#include "sovo/vo/vignette_estimate.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

#include "sovo/vo/median.h"

namespace sovo {

namespace {

constexpr double kForgetSights =
    0.9;  ///< A keyframe: what the first ones told was seen through most.
/// Poses and depths give way to what is not corrected, so that about half of it is seen.
constexpr double kAmplify = 2.0;
constexpr double kStep = 0.5;  ///< Of the way to the estimate, a keyframe.
constexpr double kLargestStep =
    0.08;  ///< Of log V: images of two vignettes are compared meanwhile.
constexpr double kLeastChange = 0.005;  ///< Of log V; less would be noise in every frame.
constexpr double kPrior = 4.0;          ///< On each term: half of the light, give or take.
constexpr double kDarkest = -1.6;       ///< log V in the corners, at least: a fifth of the light.
constexpr double kDark = 8.0;           ///< Grey levels between which logarithms
constexpr double kBright = 248.0;       ///< are compared.
constexpr std::size_t kFewestSights = 20;
constexpr int kFewestInQuarter = 10;
constexpr double kHuberSigmas = 1.345;  ///< Standard deviations.
constexpr double kLeastSigma = 0.003;   ///< Of the logarithm of a mean of grey levels.

/// What one image shows of a point.
struct View {
  Vec3 basis;
  double x = 0.0, y = 0.0;  ///< From the principal point, shares of the image's sides.
  double log_grey = 0.0;
  double log_known = 0.0;  ///< Of the vignette that the image is freed of.
};

std::optional<View> view_of(const OffAxis& off_axis, const CameraModel& camera,
                            const Keyframe& keyframe, double u, double v, double grey) {
  if (grey <= 0.0) return std::nullopt;
  View view;
  const double x = u - camera.cx;
  const double y = v - camera.cy;
  const double s = off_axis.of(x / camera.fx, y / camera.fy);
  view.basis = Vec3(RadialVignette::basis(s).data());
  view.x = x / camera.width;
  view.y = y / camera.height;
  view.log_grey = std::log(grey);
  view.log_known = keyframe.vignette.log_at(s);
  const double as_it_came = view.log_grey + view.log_known;
  if (as_it_came < std::log(kDark) || as_it_came > std::log(kBright)) return std::nullopt;
  return view;
}

int quarter_of(const View& view) {
  if (std::abs(view.x) > std::abs(view.y)) return view.x > 0.0 ? 0 : 2;
  return view.y > 0.0 ? 1 : 3;
}

/// Of the logarithm of the grey levels as they came, as if nothing had given way to it.
double whole_ratio(const VignetteSight& sight) {
  return kAmplify * sight.log_ratio + sight.log_known;
}

/// Huber's weights of the sights of a pair, about their median.
std::vector<double> weights_of(const std::vector<VignetteSight>& pair, const Vec3& terms) {
  std::vector<double> errors;
  errors.reserve(pair.size());
  for (const VignetteSight& s : pair) errors.push_back(whole_ratio(s) - s.basis.dot(terms));
  std::vector<double> scratch;
  const double middle = median(errors, &scratch);
  for (double& e : errors) e = std::abs(e - middle);
  const double sigma = std::max(1.48 * median(errors, &scratch), kLeastSigma);
  for (double& e : errors) {
    e = std::min(1.0, kHuberSigmas * sigma / std::max(e, kLeastSigma)) / (sigma * sigma);
  }
  return errors;
}

/// Weighted sums over the sights in a quarter of a pair.
struct QuarterSums {
  int sights = 0;
  double weight = 0.0, ratio = 0.0;
  Vec3 basis = Vec3::Zero(), product = Vec3::Zero();
  Mat3 square = Mat3::Zero();
};

}  // namespace

Vec3 solve_without_positive(const Mat3& H, const Vec3& g) {
  Vec3 best = Vec3::Zero();
  double least = 0.0;
  for (unsigned used = 1; used < 8; ++used) {
    const auto is_used = [&](Eigen::Index i) { return (used >> i & 1U) != 0; };
    Mat3 A = Mat3::Identity();
    Vec3 b = Vec3::Zero();
    for (Eigen::Index i = 0; i < 3; ++i) {
      if (is_used(i)) b(i) = g(i);
      for (Eigen::Index j = 0; j < 3; ++j) {
        if (is_used(i) && is_used(j)) A(i, j) = H(i, j);
      }
    }
    const Vec3 c = A.ldlt().solve(b);
    const double energy = c.dot(H * c) - 2.0 * g.dot(c);
    if (c.maxCoeff() <= 0.0 && energy < least) {
      least = energy;
      best = c;
    }
  }
  return best;
}

RadialVignette VignetteEstimate::current() const {
  const std::lock_guard lock(mutex_);
  return current_;
}

std::vector<VignetteSight> VignetteEstimate::sights(const Window& window, int host,
                                                    const std::vector<PointSight>& seen) const {
  const CameraModel& camera = window.camera();
  std::vector<VignetteSight> sights;
  sights.reserve(seen.size());
  for (const PointSight& s : seen) {
    const auto from = view_of(off_axis_, camera, window[host], s.u_host, s.v_host, s.grey_host);
    const auto to = view_of(off_axis_, camera, window.newest(), s.u, s.v, s.grey);
    if (!from || !to) continue;
    sights.push_back({to->basis - from->basis, to->log_grey - from->log_grey,
                      to->log_known - from->log_known, quarter_of(*to)});
  }
  return sights;
}

void VignetteEstimate::observe(const Window& window, const PointSights& seen) {
  std::vector<std::vector<VignetteSight>> pairs;
  pairs.reserve(seen.size());
  for (const auto& of_host : seen) {
    pairs.push_back(sights(window, static_cast<int>(pairs.size()), of_host));
  }
  observe(pairs);
}

void VignetteEstimate::observe(const std::vector<std::vector<VignetteSight>>& pairs) {
  H_ *= kForgetSights;
  g_ *= kForgetSights;
  for (const auto& pair : pairs) {
    if (pair.size() >= kFewestSights) add(pair);
  }
  terms_ = solve_without_positive(H_ + kPrior * Mat3::Identity(), g_);
  terms_ *= std::min(1.0, kDarkest / std::min(terms_.sum(), kDarkest));
  step();
}

/// The brightness of each quarter is eliminated.
void VignetteEstimate::add(const std::vector<VignetteSight>& pair) {
  const std::vector<double> weights = weights_of(pair, terms_);
  std::array<QuarterSums, 4> quarters;
  for (std::size_t i = 0; i < pair.size(); ++i) {
    QuarterSums& q = quarters[static_cast<std::size_t>(pair[i].quarter)];
    const Vec3 weighted = weights[i] * pair[i].basis;
    const double ratio = whole_ratio(pair[i]);
    ++q.sights;
    q.weight += weights[i];
    q.ratio += weights[i] * ratio;
    q.basis += weighted;
    q.product += ratio * weighted;
    q.square += weighted * pair[i].basis.transpose();
  }
  for (const QuarterSums& q : quarters) {
    if (q.sights < kFewestInQuarter) continue;
    H_ += q.square - q.basis * q.basis.transpose() / q.weight;
    g_ += q.product - q.basis * q.ratio / q.weight;
  }
}

void VignetteEstimate::step() {
  const std::lock_guard lock(mutex_);
  const Vec3 way = terms_ - Vec3(current_.terms.data());
  double length = 0.0;
  for (const double s : {0.25, 0.5, 0.75, 1.0}) {
    length = std::max(length, std::abs(way.dot(Vec3(RadialVignette::basis(s).data()))));
  }
  const double share = std::min(kStep, kLargestStep / std::max(length, kLargestStep));
  if (share * length <= kLeastChange) return;
  for (std::size_t i = 0; i < 3; ++i) {
    current_.terms[i] += share * way(static_cast<Eigen::Index>(i));
  }
}

}  // namespace sovo
