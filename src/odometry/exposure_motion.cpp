#include "sovo/odometry/exposure_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sovo {

std::int64_t exposure_offset_ns(const StereoFrame& frame) {
  constexpr double kSigmas = 3.0;
  const std::int64_t offset = frame.right.stamp_offset_ns - frame.left.stamp_offset_ns;
  const double error = kSigmas * std::numbers::sqrt2 * frame.stamp_sigma_s;
  return std::abs(1e-9 * static_cast<double>(offset)) > error ? offset : 0;
}

void ExposureMotion::note(const ReferenceKeyframe& reference, const SE3& T_camera_reference,
                          std::int64_t stamp_ns) {
  const auto last_stamp_ns = frames_.last_stamp_ns();
  frames_.note(reference, T_camera_reference, stamp_ns);
  if (last_stamp_ns == stamp_ns) {
    const auto known = frames_.forecast(reference, stamp_ns, 0.0).known;
    if (known && newest_) newest_->rate = known->step.log() / newest_->seconds;
    return;
  }
  before_ = newest_;
  if (before_) before_->rate.head<3>() *= std::exp(reference.log_scale - log_scale_);
  log_scale_ = reference.log_scale;
  newest_.reset();
  const auto known = frames_.forecast(reference, stamp_ns, 0.0).known;
  if (!known || !last_stamp_ns || stamp_ns <= *last_stamp_ns) return;
  const double seconds = seconds_between(*last_stamp_ns, stamp_ns);
  newest_ = Step{known->step.log() / seconds, seconds};
}

SE3 ExposureMotion::until(std::int64_t offset_ns) const {
  if (offset_ns == 0 || !newest_) return {};
  const double offset = 1e-9 * static_cast<double>(offset_ns);
  return SE3::exp(offset * rate_after(0.5 * offset));
}

Vec6 ExposureMotion::rate_after(double seconds) const {
  if (!newest_) return Vec6::Zero();
  if (!before_) return newest_->rate;
  // Each rate is that of the middle of its step. What lies farther ahead than the next frame is not
  // to be told from two steps.
  constexpr double kFarthest = 1.5;
  const double steps = (newest_->seconds + 2.0 * seconds) / (newest_->seconds + before_->seconds);
  return newest_->rate + std::min(steps, kFarthest) * (newest_->rate - before_->rate);
}

}  // namespace sovo
