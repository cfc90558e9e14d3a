#include <array>
#include <cmath>

#include "sovo/vo/direct_odometry.h"
#include "sovo/vo/keyframe_policy.h"

namespace sovo {

namespace {

/// Rotations tried around the expected motion when nothing else fits [rad]: 2.3, 3.2 and 4.0
/// degrees over one, two and three axes.
constexpr std::array<double, 1> kRescueAngles = {0.04};

void add_rotations(const SE3& around, std::vector<SE3>* hypotheses) {
  for (const double angle : kRescueAngles) {
    for (int i = 0; i < 27; ++i) {
      const Vec3 axis(i % 3 - 1, (i / 3) % 3 - 1, i / 9 - 1);
      if (axis.isZero()) continue;
      hypotheses->push_back(SE3(SO3::exp(angle * axis), Vec3::Zero()) * around);
    }
  }
}

/// Motions to try when none is known: translations along each axis in shares of the mean depth,
/// and rotations.
std::vector<SE3> unknown_motions(const SE3& around, double mean_rho) {
  constexpr std::array<double, 5> kShares = {0.02, 0.04, 0.07, 0.11, 0.16};
  std::vector<SE3> out = {around};
  for (const double share : kShares) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double sign : {-1.0, 1.0}) {
        Vec3 t = Vec3::Zero();
        t[axis] = sign * share / mean_rho;
        out.push_back(SE3(SO3(), t) * around);
      }
    }
  }
  add_rotations(around, &out);
  return out;
}

constexpr std::size_t kUnknownMotionsKept = 4;

SE3 scaled_motion(const SE3& motion, double factor) { return SE3::exp(factor * motion.log()); }

}  // namespace

void DirectOdometry::find_motion_hypotheses(const TrackingReference& reference,
                                            const MonoFrame& frame) {
  const SE3 T_reference_world = reference.T_world_camera.inverse();
  // Past frames relative to the reference, in its scale.
  std::array<SE3, 2> from_reference;
  std::size_t known = 0;
  for (const PastFrame& past : past_) {
    if (past.stamp_ns == reference.stamp_ns) {
      from_reference[known++] = SE3();
      continue;
    }
    for (const auto& [id, T_world_keyframe] : reference.keyframe_poses) {
      if (id != past.keyframe_id) continue;
      SE3 T = past.T_camera_keyframe;
      T.translation() *= std::exp(reference.log_scale - past.log_scale);
      from_reference[known++] = T * (T_reference_world * T_world_keyframe).inverse();
      break;
    }
  }
  const SE3 last = known == 0 ? SE3() : from_reference[known - 1];
  if (known < 2) {
    hypotheses_ = tracker_.rank(reference, *frame.pyramid, frame.exposure_s, last_affine_,
                                unknown_motions(last, reference.mean_rho), kUnknownMotionsKept);
    return;
  }
  // Constant velocity over the true time between the frames, which may have been dropped.
  const SE3 motion = last * from_reference[0].inverse();
  const SE3 expected = scaled_motion(motion, expected_steps_) * last;
  hypotheses_ = {expected, scaled_motion(motion, 2.0 * expected_steps_) * last,
                 scaled_motion(motion, 0.5 * expected_steps_) * last, last, SE3()};
  add_rotations(expected, &hypotheses_);
}

TrackedFrame DirectOdometry::track(const MonoFrame& frame) {
  expected_steps_ = 1.0;
  if (past_.size() == 2 && past_[1].stamp_ns > past_[0].stamp_ns) {
    const auto before = static_cast<double>(past_[1].stamp_ns - past_[0].stamp_ns);
    expected_steps_ = static_cast<double>(frame.stamp_ns - past_[1].stamp_ns) / before;
  }
  auto ref = reference();
  find_motion_hypotheses(*ref, frame);
  return track_hypotheses(frame, std::move(ref));
}

TrackedFrame DirectOdometry::track_from(const MonoFrame& frame, const SE3& T_current_reference) {
  hypotheses_ = {T_current_reference};
  return track_hypotheses(frame, reference());
}

TrackedFrame DirectOdometry::track_hypotheses(const MonoFrame& frame,
                                              std::shared_ptr<const TrackingReference> reference) {
  TrackedFrame out;
  out.frame = frame;
  out.reference = std::move(reference);
  const TrackingReference& ref = *out.reference;
  const bool same_reference = has_first_rmse_ && first_rmse_keyframe_ == ref.keyframe_id;
  out.tracking =
      tracker_.track(ref, *frame.pyramid, frame.exposure_s, last_affine_, hypotheses_, last_rmse_);
  if (!out.tracking.good) return out;

  if (!same_reference) {
    first_rmse_ = out.tracking.rmse;
    first_rmse_keyframe_ = ref.keyframe_id;
    has_first_rmse_ = true;
  }
  last_rmse_ = out.tracking.rmse;
  last_affine_ = out.tracking.affine;
  out.T_world_camera = ref.T_world_camera * out.tracking.T_current_reference.inverse();
  out.wants_keyframe =
      wants_keyframe(config_.keyframe, camera_, ref, out.tracking, frame.exposure_s, first_rmse_);
  past_.push_back(
      {out.tracking.T_current_reference, ref.log_scale, ref.keyframe_id, frame.stamp_ns});
  if (past_.size() > 2) past_.erase(past_.begin());
  return out;
}

}  // namespace sovo
