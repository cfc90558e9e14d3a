#include "sovo/vo/pattern_fit.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "sovo/image/interpolation.h"

namespace sovo {

namespace {

using Values = ReferencePatterns::Values;

void take_mean_off(Values* values) {
  const float mean =
      std::accumulate(values->begin(), values->end(), 0.0F) / static_cast<float>(kPatternSize);
  for (float& value : *values) value -= mean;
}

bool is_inside(const ImageF& image, float u, float v) {
  // Written so that NaN counts as outside.
  return u >= 1.0F && v >= 1.0F && u < static_cast<float>(image.width() - 2) &&
         v < static_cast<float>(image.height() - 2);
}

double robust_square(double residual, const RobustNorm& norm) {
  const double size = std::min(std::abs(residual), norm.cutoff);
  return size <= norm.huber ? size * size : norm.huber * (2.0 * size - norm.huber);
}

/// How grey levels agree with others.
class Agreement {
 public:
  void add(const Values& own, const Values& seen, const RobustNorm& norm) {
    for (std::size_t k = 0; k < kPatternSize; ++k) {
      const double x = own[k];
      const double y = seen[k];
      energy_ += robust_square(y - x, norm);
      ++n_;
      x_ += x;
      y_ += y;
      xx_ += x * x;
      yy_ += y * y;
      xy_ += x * y;
    }
  }

  /// Root of the mean robust square, over the share of the variance that is explained.
  double unexplained(const RobustNorm& norm) const {
    constexpr double kLeast = 1e-6;  // of the variance
    const double covariance = n_ * xy_ - x_ * y_;
    if (n_ == 0.0 || covariance <= 0.0) return norm.cutoff / kLeast;
    const double variances = (n_ * xx_ - x_ * x_) * (n_ * yy_ - y_ * y_);
    return std::sqrt(energy_ / n_) / std::max(covariance * covariance / variances, kLeast);
  }

 private:
  double energy_ = 0.0, n_ = 0.0;
  double x_ = 0.0, y_ = 0.0, xx_ = 0.0, yy_ = 0.0, xy_ = 0.0;
};

}  // namespace

ReferencePatterns::ReferencePatterns(const ReferenceLevel& points, const ImageF& image)
    : camera_(points.camera) {
  patterns_.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    Pattern pattern{.u = points.u[i], .v = points.v[i], .rho = points.rho[i], .values = {}};
    bool inside = true;
    for (std::size_t k = 0; k < kPatternSize && inside; ++k) {
      const float u = pattern.u + kPattern[k].x;
      const float v = pattern.v + kPattern[k].y;
      inside = is_inside(image, u, v);
      if (inside) pattern.values[k] = image.at(static_cast<int>(u), static_cast<int>(v));
    }
    if (inside) patterns_.push_back(pattern);
  }
}

bool ReferencePatterns::take(const Pattern& pattern, const ImageF& image,
                             const Eigen::Matrix3f& KRKi, const Eigen::Vector3f& Kt, Values* seen) {
  for (std::size_t k = 0; k < kPatternSize; ++k) {
    const Eigen::Vector3f at(pattern.u + kPattern[k].x, pattern.v + kPattern[k].y, 1.0F);
    const Eigen::Vector3f p = KRKi * at + Kt * pattern.rho;
    const float u = p.x() / p.z();
    const float v = p.y() / p.z();
    if (!(p.z() > 0.0F) || !is_inside(image, u, v)) return false;
    (*seen)[k] = sample(image, u, v);
  }
  return true;
}

double ReferencePatterns::unexplained(const ImageF& image, const SE3& T_current_reference,
                                      const KnownLight& light, const RobustNorm& norm) const {
  const Mat3 K = camera_.matrix();
  const Eigen::Matrix3f KRKi =
      (K * T_current_reference.rotation_matrix() * K.inverse()).cast<float>();
  const Eigen::Vector3f Kt = (K * T_current_reference.translation()).cast<float>();
  Agreement whole, contrast;
  for (const Pattern& pattern : patterns_) {
    Values own = pattern.values;
    Values seen;
    if (!take(pattern, image, KRKi, Kt, &seen)) continue;
    for (float& value : own)
      value = static_cast<float>(light.transfer.gain * value + light.transfer.bias);
    whole.add(own, seen, norm);
    if (light.is_all) continue;
    take_mean_off(&own);
    take_mean_off(&seen);
    contrast.add(own, seen, norm);
  }
  const double of_whole = whole.unexplained(norm);
  return light.is_all ? of_whole : std::sqrt(of_whole * contrast.unexplained(norm));
}

}  // namespace sovo
