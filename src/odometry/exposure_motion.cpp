#include "sovo/odometry/exposure_motion.h"

#include <cmath>

namespace sovo {

void ExposureMotion::note(const ReferenceKeyframe& reference, const SE3& T_camera_reference,
                          std::int64_t stamp_ns) {
  const auto last_stamp_ns = frames_.last_stamp_ns();
  frames_.note(reference, T_camera_reference, stamp_ns);
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
  Vec6 rate = newest_->rate;
  if (before_) {
    // Each rate is that of the middle of its step, the one wanted that of the offset's middle.
    const Vec6 change = newest_->rate - before_->rate;
    rate += (newest_->seconds + offset) / (newest_->seconds + before_->seconds) * change;
  }
  return SE3::exp(offset * rate);
}

}  // namespace sovo
