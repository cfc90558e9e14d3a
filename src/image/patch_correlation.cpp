#include "sovo/image/patch_correlation.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "sovo/image/interpolation.h"

namespace sovo {

namespace {

using Vec2f = Eigen::Vector2f;
using Mat2f = Eigen::Matrix2f;

constexpr int kHalfAlong = kPatchAlong / 2;
constexpr int kHalfAcross = kPatchAcross / 2;
constexpr int kNodeSteps = 4;      ///< Steps between exact projections.
constexpr int kSegmentSteps = 24;  ///< Steps that share one warp of the base patch.
constexpr double kMinSpeed = 1e-6;
constexpr double kMaxShear = 0.6;       ///< Displacement along the curve a row across [px].
constexpr double kShearPrior = 2500.0;  ///< Residuals of 5 grey levels against 0.1 px a row.

bool readable(const ImageF& image, const Vec2f& p) {
  return p.x() >= 0.0F && p.y() >= 0.0F && p.x() < static_cast<float>(image.width() - 1) &&
         p.y() < static_cast<float>(image.height() - 1);
}

/// Whether the parallelogram center +- a +- b can be sampled.
bool readable(const ImageF& image, const Vec2f& center, const Vec2f& a, const Vec2f& b) {
  const Vec2f reach = a.cwiseAbs() + b.cwiseAbs();
  return readable(image, center - reach) && readable(image, center + reach);
}

/// Samples a grid around `center`, `axes` = (along, across) steps; along is the slow index, as in
/// a strip. False when it leaves the image.
template <int kHalfS, int kHalfT>
bool sample_grid(const ImageF& image, const Vec2f& center, const Mat2f& axes, float* out) {
  const Vec2f s = axes.col(0);
  const Vec2f t = axes.col(1);
  if (!readable(image, center, kHalfS * s, kHalfT * t)) return false;
  for (int i = -kHalfS; i <= kHalfS; ++i) {
    for (int j = -kHalfT; j <= kHalfT; ++j) {
      const Vec2f p = center + static_cast<float>(i) * s + static_cast<float>(j) * t;
      *out++ = sample(image, p.x(), p.y());
    }
  }
  return true;
}

float sum_of(const float* v) {
  float sum = 0.0F;
  for (int i = 0; i < kPatchSize; ++i) sum += v[i];
  return sum;
}

float dot(const float* a, const float* b) {
  float lanes[4] = {0.0F, 0.0F, 0.0F, 0.0F};  // independent sums, so that they can be vectorized
  int i = 0;
  for (; i + 4 <= kPatchSize; i += 4) {
    for (int k = 0; k < 4; ++k) lanes[k] += a[i + k] * b[i + k];
  }
  for (; i < kPatchSize; ++i) lanes[0] += a[i] * b[i];
  return (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]);
}

using Patch = std::array<float, kPatchSize>;

void remove_mean(Patch* patch) {
  const float mean = sum_of(patch->data()) / kPatchSize;
  for (float& v : *patch) v -= mean;
}

/// Zero mean, unit length; all zero when there is no texture.
void normalize(Patch* patch) {
  remove_mean(patch);
  const float energy = dot(patch->data(), patch->data());
  const float scale = energy > 1e-3F ? 1.0F / std::sqrt(energy) : 0.0F;
  for (float& v : *patch) v *= scale;
}

/// Axes along and across the curve in the target [px], from its direction.
Mat2f axes_of(const Vec2& direction) {
  const Vec2f e = direction.normalized().cast<float>();
  Mat2f axes;
  axes << e.x(), -e.y(), e.y(), e.x();
  return axes;
}

/// Target image along the curve: one column of kPatchAcross pixels a step.
struct Strip {
  static constexpr int kColumns = CorrelationProfile::kCapacity + kPatchAlong - 1;
  int size = 0;
  std::array<float, kColumns * kPatchAcross> pixels;
  std::array<float, kColumns> sum, energy, rho;
  std::array<bool, kColumns> seen;
  std::array<Vec2f, kColumns> position;
};

void append_column(const ImageF& image, const Vec2f& center, const Vec2f& across, float rho,
                   Strip* strip) {
  const int k = strip->size++;
  strip->rho[k] = rho;
  strip->position[k] = center;
  strip->seen[k] = readable(image, center, Vec2f::Zero(), kHalfAcross * across);
  strip->sum[k] = strip->energy[k] = 0.0F;
  if (!strip->seen[k]) return;
  float* column = strip->pixels.data() + static_cast<std::ptrdiff_t>(k) * kPatchAcross;
  for (int j = 0; j < kPatchAcross; ++j) {
    const Vec2f p = center + static_cast<float>(j - kHalfAcross) * across;
    column[j] = sample(image, p.x(), p.y());
    strip->sum[k] += column[j];
    strip->energy[k] += column[j] * column[j];
  }
}

/// Samples the target from half a patch before rho_min to half a patch after rho_max; ends early
/// when the curve has left the image for good.
void sample_strip(const PatchSearch& search, int level, double rho_min, double rho_max,
                  Strip* strip) {
  const ImageF& image = search.target->level(level);
  const double scale = 1.0 / (1 << level);
  strip->size = 0;
  auto node = search.curve.at(rho_min);
  if (!node || node->derivative.norm() * scale < kMinSpeed) return;
  double rho = rho_min - kHalfAlong / (node->derivative.norm() * scale);
  node = search.curve.at(rho);
  bool entered = false;
  int after = 0;  // columns past rho_max
  while (node && after < kHalfAlong) {
    const double speed = node->derivative.norm() * scale;
    if (speed < kMinSpeed) return;
    const double d_rho = kNodeSteps / speed;
    const auto next = search.curve.at(rho + d_rho);
    if (!next) return;
    const Vec2f from = to_level(node->pixel, level).cast<float>();
    const Vec2f step = (to_level(next->pixel, level).cast<float>() - from) / kNodeSteps;
    const Vec2f across(-step.y() / step.norm(), step.x() / step.norm());
    for (int j = 0; j < kNodeSteps && after < kHalfAlong; ++j) {
      if (strip->size == Strip::kColumns) return;
      const double at = rho + d_rho * j / kNodeSteps;
      append_column(image, from + static_cast<float>(j) * step, across, static_cast<float>(at),
                    strip);
      if (at > rho_max) ++after;
    }
    const bool inside = strip->seen[strip->size - 1];
    if (entered && !inside) return;
    entered = entered || inside;
    rho += d_rho;
    node = next;
  }
}

/// The base patch as the target would see it at `rho`, normalized.
bool base_patch(const PatchSearch& search, int level, double rho, Patch* patch) {
  const auto point = search.curve.at(rho);
  if (!point) return false;
  const Mat2f base_from_target = point->target_from_base.inverse().cast<float>();
  if (!base_from_target.allFinite()) return false;
  const Mat2f axes = base_from_target * axes_of(point->derivative);
  const Vec2f center = to_level(search.pixel, level).cast<float>();
  if (!sample_grid<kHalfAlong, kHalfAcross>(search.base->level(level), center, axes,
                                            patch->data())) {
    return false;
  }
  normalize(patch);
  return true;
}

float window_score(const Strip& strip, int first, const Patch& patch) {
  float sum = 0.0F;
  float energy = 0.0F;
  for (int k = first; k < first + kPatchAlong; ++k) {
    if (!strip.seen[k]) return CorrelationProfile::kUnseen;
    sum += strip.sum[k];
    energy += strip.energy[k];
  }
  const float variance = energy - sum * sum / kPatchSize;
  if (variance < 1e-2F * kPatchSize) return 0.0F;
  return dot(patch.data(),
             strip.pixels.data() + static_cast<std::ptrdiff_t>(first) * kPatchAcross) /
         std::sqrt(variance);
}

}  // namespace

int CorrelationProfile::best() const {
  int best = -1;
  for (int i = 0; i < size; ++i) {
    if (score[i] > kUnseen && (best < 0 || score[i] > score[best])) best = i;
  }
  return best;
}

int CorrelationProfile::best_other_mode(int from, int distance) const {
  int best = -1;
  for (int i = 0; i < size; ++i) {
    if (std::abs(i - from) <= distance || score[i] <= kUnseen) continue;
    if (i > 0 && score[i - 1] > score[i]) continue;
    if (i + 1 < size && score[i + 1] > score[i]) continue;
    if (best < 0 || score[i] > score[best]) best = i;
  }
  return best;
}

float CorrelationProfile::refined_rho(int i) const {
  if (i <= 0 || i + 1 >= size || score[i - 1] <= kUnseen || score[i + 1] <= kUnseen) return rho[i];
  const float curvature = score[i - 1] - 2.0F * score[i] + score[i + 1];
  if (curvature >= -1e-6F) return rho[i];
  const float offset = 0.5F * (score[i - 1] - score[i + 1]) / curvature;
  return rho[i] + std::clamp(offset, -0.5F, 0.5F) * step_rho(i);
}

bool correlate(const PatchSearch& search, int level, double rho_min, double rho_max,
               CorrelationProfile* profile) {
  Strip strip;
  sample_strip(search, level, rho_min, rho_max, &strip);
  profile->size = std::max(0, strip.size - (kPatchAlong - 1));
  Patch patch{};
  bool fits = false;
  for (int begin = 0; begin < profile->size; begin += kSegmentSteps) {
    const int end = std::min(begin + kSegmentSteps, profile->size);
    const int middle = (begin + end) / 2 + kHalfAlong;
    const bool usable = base_patch(search, level, static_cast<double>(strip.rho[middle]), &patch);
    fits = fits || usable;
    for (int i = begin; i < end; ++i) {
      profile->rho[i] = strip.rho[i + kHalfAlong];
      profile->position[i] = strip.position[i + kHalfAlong];
      profile->score[i] = usable ? window_score(strip, i, patch) : CorrelationProfile::kUnseen;
    }
  }
  return fits;
}

namespace {

/// The base patch at level 0 with its derivatives, means removed, and the normal matrix of (gain,
/// displacement along the curve, shear, displacement across). Shear is displacement along a row
/// across: the ground, seen from a car, moves by a third of a pixel a row.
struct Template {
  Patch value, along, shear, across;
  Mat4 normal;
  Mat2f axes;  ///< Along and across in the target image.
};

bool make_template(const PatchSearch& search, const CurvePoint& point, Template* out) {
  constexpr int kColumn = kPatchAcross + 2;
  std::array<float, (kPatchAlong + 2) * kColumn> grid;
  out->axes = axes_of(point.derivative);
  const Mat2f base_from_target = point.target_from_base.inverse().cast<float>();
  if (!base_from_target.allFinite()) return false;
  if (!sample_grid<kHalfAlong + 1, kHalfAcross + 1>(search.base->level(0),
                                                    search.pixel.cast<float>(),
                                                    base_from_target * out->axes, grid.data())) {
    return false;
  }
  for (int i = 0; i < kPatchAlong; ++i) {
    for (int j = 0; j < kPatchAcross; ++j) {
      const float* g = grid.data() + (i + 1) * kColumn + j + 1;
      const auto k = static_cast<std::size_t>(i * kPatchAcross + j);
      out->value[k] = g[0];
      out->along[k] = 0.5F * (g[kColumn] - g[-kColumn]);
      out->shear[k] = static_cast<float>(j - kHalfAcross) * out->along[k];
      out->across[k] = 0.5F * (g[1] - g[-1]);
    }
  }
  remove_mean(&out->value);
  remove_mean(&out->along);
  remove_mean(&out->shear);
  remove_mean(&out->across);
  const std::array<const Patch*, 4> columns = {&out->value, &out->along, &out->shear, &out->across};
  for (std::size_t i = 0; i < columns.size(); ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      out->normal(i, j) = out->normal(j, i) =
          static_cast<double>(dot(columns[i]->data(), columns[j]->data()));
    }
  }
  out->normal(2, 2) += kShearPrior;
  return true;
}

/// Where and how the target is sampled: moved during the alignment.
struct Placement {
  Vec2 pixel;
  double shear = 0.0;
};

/// Least squares of the target patch on the template: target = gain * (value + d_along * along +
/// shear * row * along + d_across * across) + bias, inverse-compositional (the normal matrix
/// stays).
struct Fit {
  double along = 0.0, shear = 0.0, across = 0.0;  ///< Of the target from where it fits best [px].
  double residual_variance = 0.0;                 ///< In grey levels of the base, squared.
  double zncc = 0.0;
};

bool fit(const PatchSearch& search, const Template& base, const Placement& at, bool both,
         Fit* out) {
  Patch target;
  Mat2f axes = base.axes;
  axes.col(1) += static_cast<float>(at.shear) * axes.col(0);
  if (!sample_grid<kHalfAlong, kHalfAcross>(search.target->level(0), at.pixel.cast<float>(), axes,
                                            target.data())) {
    return false;
  }
  remove_mean(&target);
  const Vec4 b(static_cast<double>(dot(base.value.data(), target.data())),
               static_cast<double>(dot(base.along.data(), target.data())),
               static_cast<double>(dot(base.shear.data(), target.data())),
               static_cast<double>(dot(base.across.data(), target.data())));
  Vec4 x = Vec4::Zero();
  if (both) {
    x = base.normal.ldlt().solve(b);
  } else {
    x.head<3>() = base.normal.topLeftCorner<3, 3>().inverse() * b.head<3>();
  }
  if (!(x[0] > 1e-3) || !x.allFinite()) return false;
  const double energy = static_cast<double>(dot(target.data(), target.data()));
  out->along = x[1] / x[0];
  out->shear = x[2] / x[0];
  out->across = x[3] / x[0];
  out->residual_variance =
      std::max(0.0, energy - x.dot(b)) / (kPatchSize - (both ? 5 : 4)) / (x[0] * x[0]);
  out->zncc = b[0] / std::sqrt(std::max(1e-9, base.normal(0, 0) * energy));
  return true;
}

/// Variances of the two displacements: what the residual tells, doubled because neighbouring
/// residuals are alike, and a floor for what it does not tell. The along displacement also takes
/// over what calibration leaves across the curve where the gradient is oblique.
double along_variance(const Template& base, double residual_variance) {
  constexpr double kFloorPx = 0.1;
  constexpr double kCalibrationPx = 0.15;
  const double gg = base.normal(1, 1);
  const double oblique = kCalibrationPx * base.normal(1, 3) / gg;
  return kFloorPx * kFloorPx + oblique * oblique + 2.0 * residual_variance / gg;
}

/// Displacement across the curve: whole pixels by correlation, so that a decalibration of some
/// pixels is seen, then both displacements together.
void measure_displacement_across(const PatchSearch& search, const Template& base,
                                 const Placement& aligned, Alignment* out) {
  constexpr double kFloorPx = 0.1;
  constexpr double kMaxSigma = 1.0;
  constexpr int kReach = 2;
  out->across_px = 0.0;
  out->across_sigma_px = std::numeric_limits<double>::infinity();
  const Vec2 e = base.axes.col(0).cast<double>();
  const Vec2 n = base.axes.col(1).cast<double>();
  Placement at = aligned;
  double best = -1.0;
  Fit last;
  for (int t = -kReach; t <= kReach; ++t) {
    const Placement trial{aligned.pixel + t * n, aligned.shear};
    if (fit(search, base, trial, false, &last) && last.zncc > best) {
      best = last.zncc;
      at = trial;
    }
  }
  for (int i = 0; i < 3; ++i) {
    if (!fit(search, base, at, true, &last)) return;
    const double length = std::hypot(last.along, last.across);
    at.pixel -= std::min(1.0, 1.0 / std::max(length, 1e-9)) * (last.along * e + last.across * n);
    if (length < 0.02) break;
  }
  const double variance =
      kFloorPx * kFloorPx + 2.0 * last.residual_variance * base.normal.inverse()(3, 3);
  const double across = n.dot(at.pixel - aligned.pixel);
  if (!(variance < kMaxSigma * kMaxSigma) || std::abs(across) > kReach + 1.0) return;
  out->across_px = across;
  out->across_sigma_px = std::sqrt(variance);
}

}  // namespace

std::optional<double> gradient_along(const PatchSearch& search, double rho) {
  const auto point = search.curve.at(rho);
  Template base;
  if (!point || !make_template(search, *point, &base)) return std::nullopt;
  return std::sqrt(base.normal(1, 1) / kPatchSize);
}

std::optional<Alignment> align(const PatchSearch& search, double rho, bool measure_across) {
  constexpr int kIterations = 4;
  constexpr double kMaxMove = 1.5;  // [px]; farther is another match
  auto point = search.curve.at(rho);
  Template base;
  if (!point || !make_template(search, *point, &base)) return std::nullopt;
  const double start = rho;
  const double speed = point->derivative.norm();
  Placement at{point->pixel, 0.0};
  Fit last;
  for (int i = 0; i < kIterations; ++i) {
    if (!fit(search, base, at, false, &last)) return std::nullopt;
    const double step = std::clamp(last.along, -1.0, 1.0);
    if (std::abs(step) < 0.01 && std::abs(last.shear) < 0.01) break;
    rho -= step / speed;
    if (std::abs(rho - start) * speed > kMaxMove) return std::nullopt;
    point = search.curve.at(rho);
    if (!point) return std::nullopt;
    at.pixel = point->pixel;
    at.shear = std::clamp(at.shear - last.shear, -kMaxShear, kMaxShear);
  }
  if (!fit(search, base, at, false, &last)) return std::nullopt;
  Alignment out;
  out.rho = rho;
  out.zncc = last.zncc;
  out.px_per_rho = point->derivative.norm();
  out.sigma_px = std::sqrt(along_variance(base, last.residual_variance));
  out.pixel = point->pixel;
  if (measure_across) measure_displacement_across(search, base, at, &out);
  return out;
}

}  // namespace sovo
