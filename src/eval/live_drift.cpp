#include "sovo/eval/live_drift.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace sovo {

LiveDrift::LiveDrift(Trajectory truth) : truth_(std::move(truth)) {
  double length = 0.0;
  for (std::size_t i = 0; i < truth_.size(); ++i) {
    if (i > 0) {
      length +=
          (truth_[i].T_world_body.translation() - truth_[i - 1].T_world_body.translation()).norm();
    }
    path_.push_back(length);
  }
}

std::optional<std::size_t> LiveDrift::find(std::int64_t stamp_ns) const {
  if (truth_.size() < 2) return std::nullopt;
  const auto next = std::lower_bound(
      truth_.begin(), truth_.end(), stamp_ns,
      [](const StampedPose& pose, std::int64_t stamp) { return pose.stamp_ns < stamp; });
  auto best = next == truth_.end() ? next - 1 : next;
  if (best != truth_.begin() &&
      std::abs((best - 1)->stamp_ns - stamp_ns) < std::abs(best->stamp_ns - stamp_ns)) {
    --best;
  }
  const std::int64_t span = truth_.back().stamp_ns - truth_.front().stamp_ns;
  const std::int64_t period = span / static_cast<std::int64_t>(truth_.size() - 1);
  if (std::abs(best->stamp_ns - stamp_ns) > period / 2) return std::nullopt;
  return static_cast<std::size_t>(best - truth_.begin());
}

std::optional<LiveDrift::Value> LiveDrift::update(std::int64_t stamp_ns, std::uint32_t segment,
                                                  const SE3& T_odom_left) {
  const auto index = find(stamp_ns);
  if (!index) return std::nullopt;
  const SE3& T_truth_left = truth_[*index].T_world_body;
  if (segment_ != segment) {
    segment_ = segment;
    first_ = *index;
    T_truth_odom_ = T_truth_left * T_odom_left.inverse();
  }
  const Vec3 said = T_truth_odom_ * T_odom_left.translation();
  return Value{(said - T_truth_left.translation()).norm(), path_[*index] - path_[first_]};
}

}  // namespace sovo
