#include "sovo/vo/motion_model.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace sovo {

double seconds_between(std::int64_t from_ns, std::int64_t to_ns) {
  return 1e-9 * static_cast<double>(to_ns - from_ns);
}

SE3 expected_place(const KnownMotion& known, const SE3& found) {
  const Vec3 place = known.expected.inverse().translation();
  return {found.rotation(), -(found.rotation() * place)};
}

double improbability(const KnownMotion& known, const FrameTracking& pose, double information) {
  return information * pose.rmse * pose.rmse +
         std::pow(deviation(known, pose.T_current_reference), 2);
}

SE3 scaled_motion(const SE3& motion, double factor) { return SE3::exp(factor * motion.log()); }

SE3 KnownMotion::after(double steps_since) const { return scaled_motion(step, steps_since) * last; }

namespace {

double way_off(const KnownMotion& known, const SE3& T_current_reference) {
  const Vec3 found = T_current_reference.inverse().translation();
  return (found - known.expected.inverse().translation()).norm();
}

}  // namespace

bool is_reachable(const KnownMotion& known, const SE3& T_current_reference) {
  return way_off(known, T_current_reference) <= known.reach;
}

bool is_near(const SE3& motion, double mean_rho, double farthest) {
  return motion.translation().norm() * mean_rho < farthest;
}

bool is_nearly(const SE3& a, const SE3& b, double mean_rho) {
  constexpr double kTurn = 0.005;   // [rad]
  constexpr double kShift = 0.005;  // mean depths
  const SE3 difference = a * b.inverse();
  return difference.rotation().log().norm() < kTurn &&
         difference.translation().norm() * mean_rho < kShift;
}

double deviation(const KnownMotion& known, const SE3& T_current_reference) {
  return known.sigma > 0.0 ? way_off(known, T_current_reference) / known.sigma : 0.0;
}

void MotionModel::note(const ReferenceKeyframe& reference, const SE3& T_camera_reference,
                       std::int64_t stamp_ns) {
  if (!past_.empty() && past_.back().stamp_ns == stamp_ns) past_.pop_back();
  // A map's second frame tells how fast it began.
  if (past_.empty() && stamp_ns > reference.stamp_ns) {
    past_.push_back({SE3(), reference.log_scale, reference.keyframe_id, reference.stamp_ns});
  }
  past_.push_back({T_camera_reference, reference.log_scale, reference.keyframe_id, stamp_ns});
  if (past_.size() > 2) past_.erase(past_.begin());
}

std::optional<std::int64_t> MotionModel::last_stamp_ns() const {
  if (past_.empty()) return std::nullopt;
  return past_.back().stamp_ns;
}

double MotionModel::steps_to(std::int64_t stamp_ns) const {
  const std::int64_t before = past_[1].stamp_ns - past_[0].stamp_ns;
  if (before <= 0) return 1.0;
  return static_cast<double>(stamp_ns - past_[1].stamp_ns) / static_cast<double>(before);
}

/// Of a frame that has become a keyframe, as it stands in the window: what it was found to be by
/// itself may be far from that, and the step from there to the next keyframe no motion at all.
std::optional<SE3> MotionModel::T_past_reference(const PastFrame& past,
                                                 const ReferenceKeyframe& reference) {
  const auto find = [&](const auto& is_wanted) {
    const auto& all = reference.keyframe_poses;
    const auto found = std::find_if(all.begin(), all.end(), is_wanted);
    return found != all.end() ? &*found : nullptr;
  };
  const auto from_reference = [&](const WindowPose& keyframe) {
    return keyframe.T_world_camera.inverse() * reference.T_world_camera;
  };
  if (past.stamp_ns == reference.stamp_ns) return SE3();
  const auto* own = find([&](const WindowPose& k) { return k.stamp_ns == past.stamp_ns; });
  if (own != nullptr) return from_reference(*own);
  const auto* tracked = find([&](const WindowPose& k) { return k.id == past.keyframe_id; });
  if (tracked == nullptr) return std::nullopt;
  SE3 T = past.T_camera_keyframe;
  T.translation() *= std::exp(reference.log_scale - past.log_scale);
  return T * from_reference(*tracked);
}

MotionModel::Forecast MotionModel::forecast(const ReferenceKeyframe& reference,
                                            std::int64_t stamp_ns, double max_acceleration) const {
  std::array<SE3, 2> from_reference;
  std::size_t known = 0;
  for (const PastFrame& past : past_) {
    if (const auto T = T_past_reference(past, reference)) from_reference[known++] = *T;
  }
  Forecast out;
  out.last = known == 0 ? SE3() : from_reference[known - 1];
  if (known < 2) return out;
  KnownMotion motion{.expected = {},
                     .last = out.last,
                     .step = out.last * from_reference[0].inverse(),
                     .steps = steps_to(stamp_ns)};
  motion.expected = motion.after(motion.steps);
  if (max_acceleration > 0.0) {
    // The velocity is that of the middle between the past frames.
    const double before = seconds_between(past_[0].stamp_ns, past_[1].stamp_ns);
    const double since = seconds_between(past_[1].stamp_ns, stamp_ns);
    // Stamps and poses err as well, which counts where frames are close in time.
    constexpr double kErrors = 0.02;  // of the mean depth
    constexpr double kUsual = 0.1;    // of the greatest acceleration
    const double greatest_way = 0.5 * max_acceleration * std::abs(since * (since + before));
    motion.reach = greatest_way + kErrors / reference.mean_rho;
    motion.sigma = kUsual * greatest_way;
  }
  out.known = motion;
  return out;
}

}  // namespace sovo
