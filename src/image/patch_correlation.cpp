#include "sovo/image/patch_correlation.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "sovo/geometry/linear_solvers.h"
#include "sovo/image/patch_kernels.h"

namespace sovo {

namespace {

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

/// Samples a grid around `center`, `axes` = (along, across) steps, and up to whole lanes more.
/// False when it leaves the image.
template <int kHalfS, int kHalfT>
bool sample_grid(const ImageF& image, const Vec2f& center, const Mat2f& axes,
                 std::array<float, Grid<kHalfS, kHalfT>::kPadded>* out) {
  const Vec2f s = axes.col(0);
  const Vec2f t = axes.col(1);
  if (!readable(image, center, kHalfS * s, kHalfT * t)) return false;
  run_kernel<SampleGrid<kHalfS, kHalfT>>(image, center, s, t, out->data());
  return true;
}

float sum_of(const WideLane& v) { return sum_lane(low_half(v) + high_half(v)); }

float dot(const Patch& a, const Patch& b) {
  WideLane sum{};
  for (std::size_t i = 0; i < a.size(); i += kWideLanes) {
    sum += load_lane<WideLane>(&a[i]) * load_lane<WideLane>(&b[i]);
  }
  return sum_of(sum);
}

/// Whatever lay behind the pixels becomes zero.
void remove_mean(Patch* patch) {
  Patch& p = *patch;
  std::fill(p.begin() + kPatchSize, p.end(), 0.0F);
  WideLane sum{};
  for (std::size_t i = 0; i < p.size(); i += kWideLanes) sum += load_lane<WideLane>(&p[i]);
  const float mean = sum_of(sum) / kPatchSize;
  for (std::size_t i = 0; i < kPatchSize; ++i) p[i] -= mean;
}

/// Zero mean, unit length; all zero when there is no texture.
void normalize(Patch* patch) {
  remove_mean(patch);
  const float energy = dot(*patch, *patch);
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

/// Columns that are read with the last ones, but are none. In lanes: so few floats are filled
/// slowly otherwise.
void pad(Strip* strip) {
  const auto k = static_cast<std::size_t>(strip->size);
  // A window's columns beyond two registers' worth of windows.
  constexpr std::size_t kPadding = 3 * kWideLanes;
  static_assert(kPadding >= 2 * kWideLanes + kPatchAlong &&
                Strip::kStride >= Strip::kColumns + kPadding);
  for (std::size_t i = 0; i < kPadding; i += kWideLanes) {
    for (auto& row : strip->rows) store_lane(WideLane{}, &row[k + i]);
    store_lane(WideLane{}, &strip->sum[k + i]);
    store_lane(WideLane{}, &strip->energy[k + i]);
    store_mask(WideLaneMask{}, &strip->seen[k + i]);
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
  while (node && after < kHalfAlong && strip->size < Strip::kColumns) {
    const double speed = node->derivative.norm() * scale;
    if (speed < kMinSpeed) return;
    const double d_rho = kNodeSteps / speed;
    const auto next = search.curve.at(rho + d_rho);
    if (!next) return;
    const Vec2f from = to_level(node->pixel, level).cast<float>();
    const Vec2f step = (to_level(next->pixel, level).cast<float>() - from) / kNodeSteps;
    const Vec2f across(-step.y() / step.norm(), step.x() / step.norm());
    int count = 0;
    for (; count < kNodeSteps && after < kHalfAlong; ++count) {
      if (strip->size + count == Strip::kColumns) break;
      const double at = rho + d_rho * count / kNodeSteps;
      strip->rho[static_cast<std::size_t>(strip->size + count)] = static_cast<float>(at);
      if (at > rho_max) ++after;
    }
    run_kernel<SampleColumns>(image, ColumnRun{from, step, across}, count,
                              static_cast<std::size_t>(strip->size), strip);
    strip->size += count;
    const bool inside = strip->seen[static_cast<std::size_t>(strip->size - 1)] != 0;
    if (entered && !inside) return;
    entered = entered || inside;
    rho += d_rho;
    node = next;
  }
}

/// The base patch as the target would see it, normalized.
class BasePatch {
 public:
  BasePatch(const PatchSearch& search, int level) : search_(search), level_(level) {}

  /// As seen at `rho`. False when it leaves the image. Where it has hardly turned or stretched
  /// since the last time, as between two cameras that look in parallel, it stays.
  bool look_from(double rho) {
    constexpr float kSame = 0.01F;  // a corner moves by less than 0.06 px
    const auto point = search_.curve.at(rho);
    if (!point) return false;
    const Mat2f base_from_target = point->target_from_base.inverse().cast<float>();
    if (!base_from_target.allFinite()) return false;
    const Mat2f axes = base_from_target * axes_of(point->derivative);
    if (seen_ && (axes - axes_).cwiseAbs().maxCoeff() < kSame) return fits_;
    const Vec2f center = to_level(search_.pixel, level_).cast<float>();
    seen_ = true;
    axes_ = axes;
    fits_ =
        sample_grid<kHalfAlong, kHalfAcross>(search_.base->level(level_), center, axes, &patch_);
    if (fits_) normalize(&patch_);
    return fits_;
  }
  const Patch& patch() const { return patch_; }

 private:
  const PatchSearch& search_;
  int level_;
  bool seen_ = false, fits_ = false;
  Mat2f axes_ = Mat2f::Zero();
  alignas(32) Patch patch_{};
};

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
  float highest = kUnseen;
  for (int i = 0; i < size; ++i) {
    if (score[i] <= highest || std::abs(i - from) <= distance) continue;
    if (i > 0 && score[i - 1] > score[i]) continue;
    if (i + 1 < size && score[i + 1] > score[i]) continue;
    best = i;
    highest = score[i];
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
  pad(&strip);
  profile->size = std::max(0, strip.size - (kPatchAlong - 1));
  std::copy_n(strip.rho.begin() + kHalfAlong, profile->size, profile->rho.begin());
  BasePatch base(search, level);
  bool fits = false;
  for (int begin = 0; begin < profile->size; begin += kSegmentSteps) {
    const int end = std::min(begin + kSegmentSteps, profile->size);
    const int middle = (begin + end) / 2 + kHalfAlong;
    float* score = profile->score.data();
    if (base.look_from(static_cast<double>(strip.rho[middle]))) {
      fits = true;
      run_kernel<WindowScores>(strip, base.patch(), begin, end, score);
    } else {
      std::fill(score + begin, score + end, CorrelationProfile::kUnseen);
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

/// The base patch at level 0, as the target sees it, with a pixel more on each side.
struct TemplateGrid {
  static constexpr int kColumn = kPatchAcross + 2;
  alignas(32) std::array<float, Grid<kHalfAlong + 1, kHalfAcross + 1>::kPadded> values;

  const float* at(int i, int j) const { return values.data() + (i + 1) * kColumn + j + 1; }
  float along(int i, int j) const { return 0.5F * (at(i, j)[kColumn] - at(i, j)[-kColumn]); }
  float across(int i, int j) const { return 0.5F * (at(i, j)[1] - at(i, j)[-1]); }
};

bool sample_template(const PatchSearch& search, const CurvePoint& point, const Mat2f& axes,
                     TemplateGrid* grid) {
  const Mat2f base_from_target = point.target_from_base.inverse().cast<float>();
  return base_from_target.allFinite() && sample_grid<kHalfAlong + 1, kHalfAcross + 1>(
                                             search.base->level(0), search.pixel.cast<float>(),
                                             base_from_target * axes, &grid->values);
}

bool make_template(const PatchSearch& search, const CurvePoint& point, Template* out) {
  TemplateGrid grid;
  out->axes = axes_of(point.derivative);
  if (!sample_template(search, point, out->axes, &grid)) return false;
  for (int i = 0; i < kPatchAlong; ++i) {
    for (int j = 0; j < kPatchAcross; ++j) {
      const auto k = static_cast<std::size_t>(i * kPatchAcross + j);
      out->value[k] = grid.at(i, j)[0];
      out->along[k] = grid.along(i, j);
      out->shear[k] = static_cast<float>(j - kHalfAcross) * out->along[k];
      out->across[k] = grid.across(i, j);
    }
  }
  remove_mean(&out->value);
  remove_mean(&out->along);
  remove_mean(&out->shear);
  remove_mean(&out->across);
  const std::array<const Patch*, 4> columns = {&out->value, &out->along, &out->shear, &out->across};
  for (std::size_t i = 0; i < columns.size(); ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      out->normal(i, j) = out->normal(j, i) = static_cast<double>(dot(*columns[i], *columns[j]));
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
  alignas(32) Patch target;
  Mat2f axes = base.axes;
  axes.col(1) += static_cast<float>(at.shear) * axes.col(0);
  if (!sample_grid<kHalfAlong, kHalfAcross>(search.target->level(0), at.pixel.cast<float>(), axes,
                                            &target)) {
    return false;
  }
  remove_mean(&target);
  const Vec4 b(
      static_cast<double>(dot(base.value, target)), static_cast<double>(dot(base.along, target)),
      static_cast<double>(dot(base.shear, target)), static_cast<double>(dot(base.across, target)));
  Vec4 x = Vec4::Zero();
  if (both) {
    x = solve_small(base.normal, b);
  } else {
    x.head<3>() = base.normal.topLeftCorner<3, 3>().inverse() * b.head<3>();
  }
  if (!(x[0] > 1e-3) || !x.allFinite()) return false;
  const double energy = static_cast<double>(dot(target, target));
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
  TemplateGrid grid;
  if (!point || !sample_template(search, *point, axes_of(point->derivative), &grid)) {
    return std::nullopt;
  }
  alignas(32) Patch along;
  for (int i = 0; i < kPatchAlong; ++i) {
    for (int j = 0; j < kPatchAcross; ++j) {
      along[static_cast<std::size_t>(i * kPatchAcross + j)] = grid.along(i, j);
    }
  }
  remove_mean(&along);
  return std::sqrt(static_cast<double>(dot(along, along)) / kPatchSize);
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
