#include "sovo/scale/scale_alignment.h"

#include <algorithm>
#include <cmath>

#include "sovo/image/interpolation.h"

namespace sovo {

namespace {

constexpr int kLanes = ScalePoints::kLanes;
constexpr double kMinDispersion = 0.01;  ///< Residuals a tenth of what is expected.
constexpr double kMaxDispersion = 9.0;
constexpr int kCell = 8;                 ///< Of the z-buffer [px].
constexpr double kTurn = 1e-3;           ///< Of differences by turns of the right camera [rad].
constexpr double kLargestSlope2 = 1e14;  ///< Of a grey level by a turn [1/rad^2].
constexpr double kUnlikelyTurn = 0.02;   ///< Of the right camera [rad]: damps what nothing tells.

/// Adds the lanes up in a fixed order.
double total(const float (&lanes)[kLanes]) {
  double sum = 0.0;
  for (const float lane : lanes) sum += static_cast<double>(lane);
  return sum;
}

/// What weighting a sample needs.
struct Weighting {
  float sigma_intensity2, nu, inverse_dispersion, gain, bias;
};

Weighting weighting(const ScaleOptimizerConfig& config, double dispersion,
                    const CameraBrightness& brightness) {
  return {static_cast<float>(config.sigma_intensity * config.sigma_intensity),
          static_cast<float>(config.student_nu), static_cast<float>(1.0 / dispersion),
          brightness.gain, brightness.bias};
}

/// Residual, the inverse of its expected variance, and its square over variance and dispersion.
struct Residual {
  float r, inverse_variance, u;
};

inline Residual residual_of(const Weighting& w, float value, float reference, float gradient,
                            float relative_variance) {
  const float r = value - (w.gain * reference + w.bias);
  const float inverse_variance =
      1.0F / (w.sigma_intensity2 + gradient * gradient * relative_variance);
  return {r, inverse_variance, r * r * inverse_variance * w.inverse_dispersion};
}

/// Weighted first and second moments of left and right values.
struct Moments {
  double w = 0.0, left = 0.0, right = 0.0, left2 = 0.0, right2 = 0.0;
};

Moments moments(const ScalePoints& points, const ScaleSamples& samples, const Weighting& w,
                bool robust) {
  float sums[5][kLanes] = {};
  for (int i = 0; i < points.padded; i += kLanes) {
    for (int k = 0; k < kLanes; ++k) {
      const std::size_t j = static_cast<std::size_t>(i + k);
      const float left = points.reference[j];
      const float right = samples.value[j];
      const Residual e =
          residual_of(w, right, left, samples.gradient[j], points.relative_variance[j]);
      const float weight = samples.mask[j] * (robust ? (w.nu + 1.0F) / (w.nu + e.u) : 1.0F);
      sums[0][k] += weight;
      sums[1][k] += weight * left;
      sums[2][k] += weight * right;
      sums[3][k] += weight * left * left;
      sums[4][k] += weight * right * right;
    }
  }
  return {total(sums[0]), total(sums[1]), total(sums[2]), total(sums[3]), total(sums[4])};
}

/// The line through the means whose slope is the ratio of the deviations: unlike least squares it
/// is not flattened by points that do not yet lie where they belong.
CameraBrightness line_of(const Moments& m) {
  const double left = m.left / m.w;
  const double right = m.right / m.w;
  const double left_variance = m.left2 / m.w - left * left;
  const double right_variance = m.right2 / m.w - right * right;
  double gain = 1.0;
  if (left_variance > 1.0 && right_variance > 1.0) {
    gain = std::clamp(std::sqrt(right_variance / left_variance), 0.2, 5.0);
  }
  return {static_cast<float>(gain), static_cast<float>(right - gain * left)};
}

}  // namespace

void ScaleSamples::resize(int padded) {
  for (auto* array : {&value, &gradient, &across, &mask}) {
    array->assign(static_cast<std::size_t>(padded), 0.0F);
  }
}

ScaleAlignment::ScaleAlignment(const ScaleOptimizerConfig& config,
                               const RightProjection& projection, const ImagePyramid& left,
                               const ImagePyramid& right, ScaleWorkspace* workspace)
    : config_(config), projection_(projection), left_(left), right_(right), workspace_(workspace) {
  workspace_->samples.resize(workspace_->points.padded);
}

void ScaleAlignment::restart() {
  brightness_ = {};
  dispersion_ = 1.0;
}

void ScaleAlignment::set_level(int level) {
  level_ = level;
  workspace_->points.sample_reference(left_[level], level);
}

void ScaleAlignment::find_occlusions(double sigma) {
  ScalePoints& points = workspace_->points;
  const ScaleProjections& at = workspace_->projections;
  projection_.project(points, sigma, 0, &workspace_->projections);
  const int columns = right_[0].width() / kCell + 1;
  const int rows = right_[0].height() / kCell + 1;
  std::vector<int>& nearest = workspace_->nearest;
  nearest.assign(static_cast<std::size_t>(columns * rows), -1);
  const auto cell_of = [&](int i) -> int* {
    const auto k = static_cast<std::size_t>(i);
    if (!in_image(right_[0], at.x[k], at.y[k])) return nullptr;
    const int column = static_cast<int>(at.x[k]) / kCell;
    const int row = static_cast<int>(at.y[k]) / kCell;
    return &nearest[static_cast<std::size_t>(row * columns + column)];
  };
  const auto& rho = points.inverse_depth;
  for (int i = 0; i < points.size; ++i) {
    int* cell = cell_of(i);
    const auto k = static_cast<std::size_t>(i);
    if (cell != nullptr && (*cell < 0 || rho[k] > rho[static_cast<std::size_t>(*cell)])) *cell = i;
  }
  const auto ratio = static_cast<float>(1.0 + config_.occlusion_ratio);
  for (int i = 0; i < points.size; ++i) {
    const int* cell = cell_of(i);
    const auto k = static_cast<std::size_t>(i);
    points.visible[k] = 1.0F;
    if (cell == nullptr) continue;
    const auto n = static_cast<std::size_t>(*cell);
    const bool apart = std::abs(points.u[k] - points.u[n]) > static_cast<float>(kCell) ||
                       std::abs(points.v[k] - points.v[n]) > static_cast<float>(kCell);
    if (apart && rho[n] > ratio * rho[k]) points.visible[k] = 0.0F;
  }
}

void ScaleAlignment::linearize(double sigma) {
  const ScalePoints& points = workspace_->points;
  ScaleSamples& out = workspace_->samples;
  linearized_at_ = sigma;
  projection_.project(points, sigma, level_, &workspace_->projections);
  const ScaleProjections& at = workspace_->projections;
  const ImageF& image = right_[level_];
  const float min_shift =
      static_cast<float>(config_.min_disparity_px) / static_cast<float>(1 << level_);
  out.in_view = 0;
  out.used = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(points.size); ++i) {
    out.mask[i] = 0.0F;
    if (points.visible[i] == 0.0F || !in_image(image, at.x[i], at.y[i])) continue;
    ++out.in_view;
    const float shift2 = at.jx[i] * at.jx[i] + at.jy[i] * at.jy[i];
    if (!(shift2 >= min_shift * min_shift)) continue;
    ++out.used;
    const Sample s = sample_with_gradient(image, at.x[i], at.y[i]);
    out.value[i] = s.value;
    out.gradient[i] = s.gx * at.jx[i] + s.gy * at.jy[i];
    out.across[i] = (s.gy * at.jx[i] - s.gx * at.jy[i]) / std::sqrt(shift2);
    out.mask[i] = 1.0F;
  }
}

void ScaleAlignment::fit_brightness() {
  const ScalePoints& points = workspace_->points;
  const ScaleSamples& samples = workspace_->samples;
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    const Weighting w = weighting(config_, dispersion_, brightness_);
    const Moments m = moments(points, samples, w, round > 0);
    if (m.w < 1.0) return;
    brightness_ = line_of(m);
  }
}

ScaleSums ScaleAlignment::sums() const {
  const ScalePoints& points = workspace_->points;
  const ScaleSamples& samples = workspace_->samples;
  const Weighting w = weighting(config_, dispersion_, brightness_);
  const float inlier_u = static_cast<float>(9.0 / dispersion_);
  float sums[5][kLanes] = {};
  for (int i = 0; i < points.padded; i += kLanes) {
    for (int k = 0; k < kLanes; ++k) {
      const std::size_t j = static_cast<std::size_t>(i + k);
      const float gradient = samples.gradient[j];
      const Residual e = residual_of(w, samples.value[j], points.reference[j], gradient,
                                     points.relative_variance[j]);
      const float robust = samples.mask[j] * (w.nu + 1.0F) / (w.nu + e.u);
      const float weighted = robust * e.inverse_variance * gradient;
      sums[0][k] += weighted * gradient;
      sums[1][k] += weighted * e.r;
      sums[2][k] += robust * e.u;
      sums[3][k] += e.u < inlier_u ? samples.mask[j] : 0.0F;
      sums[4][k] += samples.mask[j];
    }
  }
  return {total(sums[0]), total(sums[1]), total(sums[2]) * dispersion_, total(sums[3]),
          total(sums[4])};
}

void ScaleAlignment::fit_dispersion(const ScaleSums& s) {
  dispersion_ = std::clamp(s.W_e2 / s.count, kMinDispersion, kMaxDispersion);
}

bool ScaleAlignment::minimize(double stop, double* sigma, int* iterations) {
  double last = 0.0;
  for (int i = 0; i < config_.max_iterations; ++i) {
    linearize(*sigma);
    if (used() < config_.min_points / 2) return false;
    if (i == 0 || i == 2) fit_brightness();
    const ScaleSums s = sums();
    ++*iterations;
    fit_dispersion(s);
    if (!(s.H > 0.0)) return false;
    double step = std::clamp(-s.b / s.H, -config_.max_step, config_.max_step);
    if (step * last < 0.0) step *= 0.7;  // about to swing
    *sigma += step;
    last = step;
    if (std::abs(step) < stop) break;
  }
  return true;
}

double ScaleAlignment::variance() const {
  const ScalePoints& points = workspace_->points;
  const ScaleSamples& samples = workspace_->samples;
  const Weighting w = weighting(config_, dispersion_, brightness_);
  double squares = 0.0;
  double weights = 0.0;
  double slopes = 0.0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(points.size); ++i) {
    const float g = samples.gradient[i];
    const Residual e =
        residual_of(w, samples.value[i], points.reference[i], g, points.relative_variance[i]);
    const float robust = samples.mask[i] * (w.nu + 1.0F) / (w.nu + e.u);
    const double psi = static_cast<double>(robust * e.inverse_variance * e.r * g);
    const double weight = static_cast<double>(robust * e.inverse_variance * g * g);
    squares += psi * psi;
    weights += weight;
    slopes += weight * static_cast<double>((w.nu - e.u) / (w.nu + e.u));  // d psi / d sigma
  }
  if (!(weights > 0.0)) return 1e6;
  const double information = std::max(slopes, 0.3 * weights);
  const double floor = config_.sigma_floor * config_.sigma_floor;
  return config_.variance_factor * squares / (information * information) + floor;
}

void ScaleAlignment::project_turned() const {
  for (int axis = 0; axis < 3; ++axis) {
    workspace_->turned = workspace_->points;
    workspace_->turned.turn_right(kTurn * Vec3::Unit(axis));
    projection_.project(workspace_->turned, linearized_at_, level_,
                        &workspace_->turned_projections[static_cast<std::size_t>(axis)]);
  }
}

TurnEquations* ScaleAlignment::cell_at(float x, float y, TurnCells* cells) const {
  const ImageF& image = right_.level(level_);
  const int column = static_cast<int>(x) * kTurnColumns / image.width();
  const int row = static_cast<int>(y) * kTurnRows / image.height();
  const int cell =
      std::clamp(row, 0, kTurnRows - 1) * kTurnColumns + std::clamp(column, 0, kTurnColumns - 1);
  return &(*cells)[static_cast<std::size_t>(cell)];
}

ScaleAlignment::TurnCells ScaleAlignment::turn_equations() const {
  project_turned();
  const ScaleProjections& at = workspace_->projections;
  const std::array<ScaleProjections, 3>& turned = workspace_->turned_projections;
  const ScalePoints& points = workspace_->points;
  const ScaleSamples& samples = workspace_->samples;
  const Weighting w = weighting(config_, dispersion_, brightness_);
  TurnCells cells;
  for (std::size_t i = 0; i < static_cast<std::size_t>(points.size); ++i) {
    if (samples.mask[i] == 0.0F) continue;
    const Residual e = residual_of(w, samples.value[i], points.reference[i], samples.gradient[i],
                                   points.relative_variance[i]);
    const double weight = static_cast<double>(e.inverse_variance * (w.nu + 1.0F) / (w.nu + e.u));
    // The image gradient from its parts along the epipolar curve and across it.
    const float shift = std::sqrt(at.jx[i] * at.jx[i] + at.jy[i] * at.jy[i]);
    const float along = samples.gradient[i] / shift;
    const float gx = (along * at.jx[i] - samples.across[i] * at.jy[i]) / shift;
    const float gy = (along * at.jy[i] + samples.across[i] * at.jx[i]) / shift;
    Eigen::Vector4d J(static_cast<double>(samples.gradient[i]), 0.0, 0.0, 0.0);
    for (std::size_t k = 0; k < 3; ++k) {
      const float moved = gx * (turned[k].x[i] - at.x[i]) + gy * (turned[k].y[i] - at.y[i]);
      J[static_cast<Eigen::Index>(k) + 1] = static_cast<double>(moved) / kTurn;
    }
    if (!(J.squaredNorm() < kLargestSlope2)) continue;  // turned out of what the lens projects
    TurnEquations* cell = cell_at(at.x[i], at.y[i], &cells);
    cell->H.noalias() += weight * J * J.transpose();
    cell->b += weight * static_cast<double>(e.r) * J;
  }
  return cells;
}

TurnStep ScaleAlignment::turn_step() const {
  const TurnCells cells = turn_equations();
  TurnEquations all;
  for (const TurnEquations& cell : cells) {
    all.H += cell.H;
    all.b += cell.b;
  }
  TurnStep out;
  if (!(all.H(0, 0) > 0.0)) return out;
  out.scale_by_turn = -all.H.block<3, 1>(1, 0) / all.H(0, 0);
  const Mat3 information = all.H.bottomRightCorner<3, 3>() +
                           all.H.block<3, 1>(1, 0) * out.scale_by_turn.transpose() +
                           Mat3::Identity() / (kUnlikelyTurn * kUnlikelyTurn);
  out.covariance = information.inverse();
  out.turn = -out.covariance * (all.b.tail<3>() + out.scale_by_turn * all.b[0]);
  out.log_scale = -all.b[0] / all.H(0, 0) + out.scale_by_turn.dot(out.turn);
  // Sandwich estimate whose clusters are the cells: what pulls within one pulls together.
  Eigen::Vector4d step;
  step << out.log_scale, out.turn;
  Vec3 variance = -out.covariance.diagonal();
  for (const TurnEquations& cell : cells) {
    const Eigen::Vector4d pull = cell.b + cell.H * step;
    variance += (out.covariance * (pull.tail<3>() + out.scale_by_turn * pull[0])).cwiseAbs2();
  }
  out.disagreement = variance.cwiseMax(0.0).cwiseSqrt();
  return out;
}

double ScaleAlignment::correlation(double sigma, int min_count) {
  const ScalePoints& points = workspace_->points;
  projection_.project(points, sigma, level_, &workspace_->projections);
  const ScaleProjections& at = workspace_->projections;
  const ImageF& image = right_[level_];
  double sums[6] = {};
  int count = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(points.size); ++i) {
    if (points.visible[i] == 0.0F || !in_image(image, at.x[i], at.y[i])) continue;
    const auto right = static_cast<double>(sample(image, at.x[i], at.y[i]));
    const auto left = static_cast<double>(points.reference[i]);
    sums[0] += left;
    sums[1] += right;
    sums[2] += left * left;
    sums[3] += right * right;
    sums[4] += left * right;
    sums[5] += static_cast<double>(at.jx[i] * at.jx[i] + at.jy[i] * at.jy[i]);
    ++count;
  }
  mean_shift_ = count > 0 ? std::sqrt(sums[5] / count) : 0.0;
  if (count < min_count || count == 0) return -1.0;
  const double left_variance = sums[2] - sums[0] * sums[0] / count;
  const double right_variance = sums[3] - sums[1] * sums[1] / count;
  if (left_variance < count || right_variance < count) return -1.0;  // less than a grey level
  return (sums[4] - sums[0] * sums[1] / count) / std::sqrt(left_variance * right_variance);
}

void ScaleAlignment::hide_unmoved(double sigma, double min_shift) {
  ScalePoints& points = workspace_->points;
  projection_.project(points, sigma, 0, &workspace_->projections);
  const ScaleProjections& at = workspace_->projections;
  for (std::size_t i = 0; i < static_cast<std::size_t>(points.size); ++i) {
    const double shift = std::hypot(static_cast<double>(at.jx[i]), static_cast<double>(at.jy[i]));
    points.visible[i] = shift >= min_shift ? 1.0F : 0.0F;
  }
}

double ScaleAlignment::residual() const {
  const ScalePoints& points = workspace_->points;
  const ScaleSamples& samples = workspace_->samples;
  double sum = 0.0;
  double weights = 0.0;
  const Weighting w = weighting(config_, dispersion_, brightness_);
  for (std::size_t i = 0; i < static_cast<std::size_t>(points.size); ++i) {
    const Residual e = residual_of(w, samples.value[i], points.reference[i], samples.gradient[i],
                                   points.relative_variance[i]);
    const double weight = static_cast<double>(samples.mask[i] * (w.nu + 1.0F) / (w.nu + e.u));
    sum += weight * static_cast<double>(e.r * e.r);
    weights += static_cast<double>(samples.mask[i]);
  }
  return weights > 0.0 ? std::sqrt(sum / weights) : 0.0;
}

}  // namespace sovo
