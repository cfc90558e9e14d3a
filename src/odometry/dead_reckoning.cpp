#include "sovo/odometry/dead_reckoning.h"

#include <algorithm>
#include <cmath>

#include "sovo/vo/motion_model.h"

namespace sovo {

namespace {

/// A frame or two before a loss may be wrong already: of so many steps the median counts.
constexpr std::size_t kSteps = 5;
constexpr double kWayGoesOn = 2.0;   ///< [s]
constexpr double kTurnGoesOn = 0.5;  ///< [s]

}  // namespace

void DeadReckoning::note(std::int64_t stamp_ns, const SE3& T_odom_left, bool goes_on) {
  if (goes_on && last_stamp_ns_ && stamp_ns > *last_stamp_ns_) {
    const SE3 step = last_.inverse() * T_odom_left;
    rates_.push_back(step.log() / seconds_between(*last_stamp_ns_, stamp_ns));
    if (rates_.size() > kSteps) rates_.erase(rates_.begin());
  }
  last_ = T_odom_left;
  last_stamp_ns_ = stamp_ns;
}

Vec6 DeadReckoning::usual_rate() const {
  Vec6 out = Vec6::Zero();
  if (rates_.empty()) return out;
  std::vector<double> values(rates_.size());
  for (Eigen::Index axis = 0; axis < 6; ++axis) {
    std::ranges::transform(rates_, values.begin(), [axis](const Vec6& r) { return r[axis]; });
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) / 2);
    std::ranges::nth_element(values, middle);
    out[axis] = *middle;
  }
  return out;
}

SE3 DeadReckoning::since_last(std::int64_t stamp_ns) const {
  if (!last_stamp_ns_) return {};
  const double since = std::clamp(seconds_between(*last_stamp_ns_, stamp_ns), 0.0, kWayGoesOn);
  const double turning = std::min(since, kTurnGoesOn);
  const Vec6 rate = usual_rate();
  const SE3 straight_on(SO3(), (since - turning) * rate.head<3>());
  return SE3::exp(turning * rate) * straight_on;
}

}  // namespace sovo
