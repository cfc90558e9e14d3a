#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "sovo/vo/features/feature_odometry.h"
#include "sovo/vo/features/reprojection.h"
#include "sovo/vo/image_rotation.h"
#include "sovo/vo/keyframe_policy.h"
#include "sovo/vo/motion_hypotheses.h"
#include "sovo/vo/point_motion.h"

namespace sovo {

TrackedFrame FeatureOdometry::track(const MonoFrame& frame, double max_acceleration) {
  auto reference = tracking_reference();
  motion_before_ = motion_;
  const MotionModel::Forecast forecast =
      motion_.forecast(*reference, frame.stamp_ns, max_acceleration);
  return track_against(frame, std::move(reference), forecast);
}

TrackedFrame FeatureOdometry::track_again(const MonoFrame& frame, const TrackedFrame& before) {
  motion_ = motion_before_;
  return track_against(frame, std::static_pointer_cast<const FeatureReference>(before.reference),
                       {before.tracking.T_current_reference, std::nullopt});
}

TrackedFrame FeatureOdometry::track_from(const MonoFrame& frame, const SE3& T_current_reference) {
  motion_kept_ = motion_;
  if (motion_.last_stamp_ns() == frame.stamp_ns) motion_ = motion_before_;
  motion_before_ = motion_;
  return track_against(frame, tracking_reference(), {T_current_reference, std::nullopt});
}

/// From the expected motion; when few features agree there, from one that turned as the whole image
/// says, whose way goes on or ended; and where that does not do, from the best of many.
FeatureTracking FeatureOdometry::align(const FeatureReference& reference, const MonoFrame& frame,
                                       const MotionModel::Forecast& forecast) const {
  // From more starts corners fit a regular pattern by chance.
  constexpr std::array kShares = {0.02, 0.04, 0.07, 0.11, 0.16, 0.23, 0.32};
  const SE3 expected = forecast.known ? forecast.known->expected : forecast.last;
  FeatureTracking best = tracker_.track(reference, frame, expected,
                                        forecast.known ? config_.levels - 1 : config_.levels);
  const auto sure = [&](const FeatureTracking& t) {
    return t.tracking.good && t.tracking.inlier_ratio >= config_.sure_inlier_ratio;
  };
  if (sure(best)) return best;
  const auto try_next = [&](const SE3& start) {
    FeatureTracking t = tracker_.track(reference, frame, start, config_.levels);
    if (t.tracking.inliers > best.tracking.inliers) best = std::move(t);
    return sure(best);
  };
  std::vector<SE3> others = turned_motions(frame, forecast);
  others.push_back(forecast.last);
  for (const SE3& other : others) {
    if (try_next(other)) return best;
  }
  if (best.tracking.good && forecast.known) return best;
  try_next(tracker_.best_of(reference, frame,
                            unknown_motions(others.front(), reference.mean_rho, kShares)));
  return best;
}

/// Motions of a camera that turned by another angle than expected, with the way going on or ended;
/// after a gap it may have gone any part of it.
std::vector<SE3> FeatureOdometry::turned_motions(const MonoFrame& frame,
                                                 const MotionModel::Forecast& forecast) const {
  constexpr double kReach = 0.27;  // 15 degrees from one frame to the next
  const double steps = forecast.known ? forecast.known->steps : 1.0;
  const int coarsest = std::min(frame.pyramid->num_levels(), last_pyramid_->num_levels()) - 1;
  const std::optional<SO3> turn =
      search_rotation((*last_pyramid_)[coarsest], (*frame.pyramid)[coarsest],
                      camera_.at_level(coarsest), SO3(), std::clamp(steps, 1.0, 1.5) * kReach);
  if (!turn) return {};
  if (!forecast.known) return {SE3(*turn, Vec3::Zero()) * forecast.last};
  const SE3 step = forecast.known->expected * forecast.last.inverse();
  const Vec3 way = *turn * (step.rotation().inverse() * step.translation());
  std::vector<SE3> motions;
  for (const double part : {1.0, 0.0, 0.5, 0.75, 0.25, 1.25}) {
    motions.push_back(SE3(*turn, part * way) * forecast.last);
    if (steps < 1.5 && motions.size() == 2) break;
  }
  return motions;
}

TrackedFrame FeatureOdometry::track_against(const MonoFrame& frame,
                                            std::shared_ptr<const FeatureReference> reference,
                                            const MotionModel::Forecast& forecast) {
  TrackedFrame out;
  out.frame = frame;
  FeatureTracking tracked = align(*reference, frame, forecast);
  out.tracking = tracked.tracking;
  if (out.tracking.good && forecast.known &&
      !is_reachable(*forecast.known, out.tracking.T_current_reference)) {
    out.tracking.good = false;
    out.tracking.out_of_reach = true;
  }
  const FeatureReference& ref = *reference;
  const SE3& found = out.tracking.T_current_reference;
  const SE3& expected = forecast.known ? forecast.known->expected : forecast.last;
  if (!is_near(found, ref.mean_rho) && !is_near(found * expected.inverse(), ref.mean_rho)) {
    out.tracking.good = false;
  }
  out.reference = std::move(reference);
  if (!out.tracking.good) return out;
  out.covariance = tracked.covariance;
  out.T_world_camera = ref.T_world_camera * out.tracking.T_current_reference.inverse();
  out.wants_keyframe = wants_keyframe(ref, tracked);
  if (out.wants_keyframe) tracker_.find_unseen(ref, frame, &tracked);
  out.views = std::move(tracked.views);
  motion_.note(ref, out.tracking.T_current_reference, frame.stamp_ns);
  last_pyramid_ = frame.pyramid;
  return out;
}

bool FeatureOdometry::wants_keyframe(const FeatureReference& reference,
                                     const FeatureTracking& tracked) const {
  ReferenceLevel points;
  points.camera = camera_;
  for (const ReferenceFeature& f : reference.features) {
    if (!f.has_depth) continue;
    Reprojection p;
    if (!reproject(camera_, f.T_reference_host, f.ray, f.rho, &p)) continue;
    points.u.push_back(static_cast<float>(p.pixel.x()));
    points.v.push_back(static_cast<float>(p.pixel.y()));
    points.rho.push_back(static_cast<float>(f.rho * p.depth_ratio));
  }
  const double clip = keyframe_config_.max_translation_flow * pixels_for_one_of_vga(camera_);
  const PointMotion motion = motion_of_points(points, tracked.tracking.T_current_reference, clip);
  const double score = motion_score(keyframe_config_, camera_, motion);
  return score > 1.0 ||
         (tracked.followed < config_.min_followed && score > keyframe_config_.rmse_min_score);
}

}  // namespace sovo
