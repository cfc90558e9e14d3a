#include "sovo/vo/motion_check.h"

#include <algorithm>
#include <cmath>

#include "sovo/image/interpolation.h"
#include "sovo/vo/point_transfer.h"

namespace sovo {

namespace {

constexpr int kFewestInCell = 2;   ///< Points.
constexpr std::size_t kAsked = 4;  ///< One of so many points.

}  // namespace

double agreeing_share(const CoMovingConfig& config, const TrackingReference& reference,
                      const ImageF& image, const SE3& T_current_reference,
                      const BrightnessTransfer& transfer) {
  const ReferenceLevel& level = reference.levels[0];
  const PointTransfer motion(level.camera, T_current_reference);
  int agree = 0;
  int textured = 0;
  for (std::size_t i = 0; i < level.size(); i += kAsked) {
    const Eigen::Vector3f at = motion(level, i);
    if (!(at.z() > 0.0F)) continue;
    const Eigen::Vector2f to = at.hnormalized();
    if (!in_image(image, to.x(), to.y(), 2.0F)) continue;
    const Sample seen = sample_with_gradient(image, to.x(), to.y());
    const double gradient = std::hypot(seen.gx, seen.gy);
    if (!(gradient > config.min_gradient)) continue;
    const double expected = transfer.gain * static_cast<double>(level.colour[i]) + transfer.bias;
    ++textured;
    if (std::abs(seen.value - expected) < config.stays_below * gradient) ++agree;
  }
  return agree / std::max(1.0, static_cast<double>(textured));
}

MotionCheck::MotionCheck(const CoMovingConfig& config, int width, int height)
    : config_(config),
      cells_(config.cell, width, height),
      sums_(cells_.size()),
      staying_(cells_.size()) {}

bool MotionCheck::agree(const Sums& sums, float residuals, float others) const {
  return sums.points >= kFewestInCell &&
         residuals < static_cast<float>(config_.better_match) * others;
}

MotionEvidence MotionCheck::of(const TrackingReference& reference, const ImageF& image,
                               const SE3& T_current_reference, const BrightnessTransfer& transfer) {
  const ReferenceLevel& level = reference.levels[0];
  const PointTransfer motion(level.camera, T_current_reference);
  const auto gain = static_cast<float>(transfer.gain);
  const auto bias = static_cast<float>(transfer.bias);
  const auto least = static_cast<float>(config_.min_displacement * config_.min_displacement);
  std::ranges::fill(sums_, Sums());
  for (std::size_t i = 0; i < level.size(); ++i) {
    const Eigen::Vector3f at = motion(level, i);
    if (!(at.z() > 0.0F)) continue;
    const Eigen::Vector2f to = at.hnormalized();
    const Eigen::Vector2f from(level.u[i], level.v[i]);
    if (!((to - from).squaredNorm() >= least)) continue;
    // The rows of a rolling shutter may have moved a point beyond the image.
    if (!in_image(image, from.x(), from.y()) || !in_image(image, to.x(), to.y())) continue;
    const float expected = gain * level.colour[i] + bias;
    Sums& sums = sums_[cells_.at(from.x(), from.y())];
    sums.in_place += std::abs(sample(image, from.x(), from.y()) - expected);
    sums.moved += std::abs(sample(image, to.x(), to.y()) - expected);
    ++sums.points;
  }
  std::ranges::transform(sums_, staying_.begin(),
                         [this](const Sums& s) { return agree(s, s.in_place, s.moved) ? 1 : 0; });
  int in_place_points = 0;
  int moved_points = 0;
  int all = 0;
  for (std::size_t i = 0; i < staying_.size(); ++i) {
    const Sums& s = sums_[i];
    all += s.points;
    if (agree(s, s.moved, s.in_place)) moved_points += s.points;
    if (staying_[i] != 0 && cells_.num_around(i, staying_) > 0) in_place_points += s.points;
  }
  const double n = std::max(1.0, static_cast<double>(level.size()));
  return {moved_points / n, in_place_points / n, all / n};
}

}  // namespace sovo
