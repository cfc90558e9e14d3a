#include "sovo/vo/static_residual.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "sovo/image/epipolar_curve.h"
#include "sovo/image/interpolation.h"
#include "sovo/vo/pattern_kernels.h"

namespace sovo {

namespace {

/// The pattern around a point of the curve.
void place_pattern(const CurvePoint& at, const ImageF& image, PatternProjection* out) {
  const auto element = [&](int i, int k) { return static_cast<float>(at.target_from_base(i, k)); };
  const PatternWarp warp = {
      {static_cast<float>(at.pixel.x()), static_cast<float>(at.pixel.y()), 1.0F},
      {element(0, 0), element(1, 0), 0.0F},
      {element(0, 1), element(1, 1), 0.0F},
      image.width(),
      image.height()};
  out->in_view = run_kernel<PlacePattern>(warp, out->fx.data(), out->fy.data(), out->offset.data());
}

/// Mean grey levels of a pattern in both images. Single pixels of the right image are interpolated,
/// and have less contrast than those of the left one.
struct PatternMeans {
  double left = 0.0, right = 0.0;
};

/// The line through the means whose slope is the ratio of the deviations; nothing where they say
/// too little.
std::optional<BrightnessTransfer> line_through(const std::vector<PatternMeans>& means) {
  constexpr std::size_t kFewest = 30;
  constexpr double kLeastVariance = 4.0;  // grey levels squared
  if (means.size() < kFewest) return std::nullopt;
  const auto n = static_cast<double>(means.size());
  Vec2 mean = Vec2::Zero();
  Vec2 squared = Vec2::Zero();
  for (const PatternMeans& m : means) {
    mean += Vec2(m.left, m.right) / n;
    squared += Vec2(m.left * m.left, m.right * m.right) / n;
  }
  const Vec2 variance = squared - mean.cwiseProduct(mean);
  if (variance.minCoeff() < kLeastVariance) return std::nullopt;
  const double gain = std::sqrt(variance[1] / variance[0]);
  return BrightnessTransfer{gain, mean[1] - gain * mean[0]};
}

/// Those of the better half of pairs: what is mismatched lies beside the line.
std::vector<PatternMeans> better_half(std::vector<PatternMeans> means,
                                      const BrightnessTransfer& line) {
  const auto middle = means.begin() + static_cast<std::ptrdiff_t>(means.size() / 2);
  const auto off = [&](const PatternMeans& m) {
    return std::abs(m.right - line.gain * m.left - line.bias);
  };
  std::nth_element(means.begin(), middle, means.end(),
                   [&](const PatternMeans& a, const PatternMeans& b) { return off(a) < off(b); });
  means.erase(middle, means.end());
  return means;
}

}  // namespace

void linearize_static(const StereoRig& rig, const WindowConfig& config, const Keyframe& host,
                      const Point& point, double rho, LinearizedResidual* out) {
  out->state = ResidualState::kOutOfView;
  out->energy = 0.0F;
  const EpipolarCurve curve =
      right_curve(rig, rig.T_right_left * host.T_later_left, Vec2(point.u, point.v));
  const auto at = curve.at(rho);
  if (!at) return;
  const ImageF& image = host.right->level(0);
  PatternProjection projection;
  place_pattern(*at, image, &projection);
  if (!projection.in_view) return;
  const auto gain = static_cast<float>(host.right_brightness.gain);
  sum_pattern(image, {gain, static_cast<float>(host.right_brightness.bias), gain, 0.0F}, point,
              config, host.huber_share, projection, out);
  out->du_rho = static_cast<float>(at->derivative.x());
  out->dv_rho = static_cast<float>(at->derivative.y());
  out->centre_u = static_cast<float>(at->pixel.x());
  out->centre_v = static_cast<float>(at->pixel.y());
  out->state = ResidualState::kIn;
  out->energy = out->raw_energy;
}

void refine_right_brightness(const StereoRig& rig, const WindowConfig& config, double scale,
                             Keyframe* keyframe) {
  if (!keyframe->right) return;
  BrightnessTransfer& brightness = keyframe->right_brightness;
  // Of the log-gain and the bias, with a prior on a change: few points tell little.
  constexpr double kPriorGain = 1e4;
  constexpr double kPriorBias = 10.0;
  Mat2 H = Vec2(kPriorGain, kPriorBias).asDiagonal();
  Vec2 b = Vec2::Zero();
  for (const Point& p : keyframe->points) {
    if (p.static_state != ResidualState::kIn) continue;
    LinearizedResidual r;
    linearize_static(rig, config, *keyframe, p, scale * p.rho, &r);
    if (r.state == ResidualState::kOutOfView) continue;
    if (judge(*keyframe, *keyframe, r.raw_energy, is_textured(r)).state != ResidualState::kIn) {
      continue;
    }
    const BrightnessPart part = brightness_part(r);
    H(0, 0) += static_cast<double>(part.aa);
    H(0, 1) += static_cast<double>(part.ab);
    H(1, 1) += static_cast<double>(part.bb);
    b += Vec2(part.gradient_a, part.gradient_b);
  }
  H(1, 0) = H(0, 1);
  const Vec2 step = -H.inverse() * b;
  brightness.gain *= std::exp(step[0]);
  brightness.bias += step[1];
}

BrightnessTransfer fit_right_brightness(const StereoRig& rig, const Keyframe& keyframe,
                                        const BrightnessTransfer& before) {
  const ImageF& image = keyframe.right->level(0);
  const SE3 T_right_left = rig.T_right_left * keyframe.T_later_left;
  std::vector<PatternMeans> means;
  const auto add = [&](float u, float v, const std::array<float, kPatternSize>& colour,
                       double rho) {
    const auto at = right_curve(rig, T_right_left, Vec2(u, v)).at(rho);
    if (!at || !rig.right.contains(at->pixel, 6.0)) return;
    double left = 0.0;
    double right = 0.0;
    for (std::size_t k = 0; k < kPatternSize; ++k) {
      const Vec2 offset(static_cast<double>(kPattern[k].x), static_cast<double>(kPattern[k].y));
      const Vec2 p = at->pixel + at->target_from_base * offset;
      left += static_cast<double>(colour[k]) / kPatternSize;
      right +=
          static_cast<double>(sample(image, static_cast<float>(p.x()), static_cast<float>(p.y()))) /
          kPatternSize;
    }
    means.push_back({left, right});
  };
  for (const Point& p : keyframe.points) add(p.u, p.v, p.colour, p.rho);
  for (const ImmaturePoint& p : keyframe.immature) {
    if (!p.from_static_match()) continue;
    add(p.u, p.v, p.colour, 0.5 * (static_cast<double>(p.rho_min) + p.rho_max));
  }
  const auto all = line_through(means);
  if (!all) return before;
  return line_through(better_half(std::move(means), *all)).value_or(*all);
}

}  // namespace sovo
