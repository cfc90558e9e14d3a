#include <algorithm>
#include <array>
#include <utility>

#include "sovo/vo/direct_odometry.h"
#include "sovo/vo/keyframe_policy.h"
#include "sovo/vo/motion_hypotheses.h"
#include "sovo/vo/staying_cells.h"

namespace sovo {

namespace {

constexpr std::size_t kMotionsKept = 4;
// Of a frame of which no motion is known, in mean depths:
constexpr std::array kUnknownShares = {0.02, 0.04, 0.07, 0.11, 0.16, 0.21, 0.27, 0.33, 0.4, 0.48};
constexpr double kFarthestUnknown = 0.75;  ///< What leads farther fits by chance.
constexpr std::size_t kStartsAhead = 44;   ///< Of all of them, those that fit best as they are.
constexpr double kAheadStep = 0.02;  ///< And of those straight on or back that are looked at again.

/// Motions to try when none of the likely ones fits: a camera that was knocked turns by another
/// angle than before, while its way goes on, or not. After a gap it may have gone any part of it.
std::vector<SE3> knocked_motions(const KnownMotion& known, const CameraModel& level) {
  constexpr double kReach = 0.2;  // 11 degrees from one frame to the next
  const SE3 step = known.expected * known.last.inverse();
  const SE3 straight_on(SO3(), step.rotation().inverse() * step.translation());
  std::vector<SE3> around = {known.expected, straight_on * known.last, known.last};
  if (known.steps > 1.5) {
    for (const double part : {0.25, 0.5, 0.75, 1.25}) {
      around.push_back(scaled_motion(step, part) * known.last);
    }
  }
  std::vector<SE3> out;
  for (const SO3& turn : turns(std::clamp(known.steps, 1.0, 2.0) * kReach, level)) {
    for (const SE3& motion : around) out.push_back(SE3(turn, Vec3::Zero()) * motion);
  }
  return out;
}

/// Whether a pose is likelier than another by its residuals and by what the motion would take.
bool is_likelier(const TrackingReference& reference, const KnownMotion& known,
                 const TrackingResult& pose, const TrackingResult& than) {
  const double variance =
      frame_variance(std::min(pose.rmse, than.rmse), reference.gradient_scatter);
  const auto points = static_cast<double>(reference.levels[0].size());
  return improbability(known, pose, points / variance) <
         improbability(known, than, points / variance);
}

Mat6 covariance_of(const TrackingResult& tracking, double gradient_scatter) {
  const double variance = frame_variance(tracking.rmse, gradient_scatter);
  const Mat6 information = tracking.information / variance + 1e-6 * Mat6::Identity();
  return information.inverse();
}

}  // namespace

void DirectOdometry::find_motion_hypotheses(const TrackingReference& reference,
                                            const MonoFrame& frame, double max_acceleration) {
  const MotionModel::Forecast forecast =
      past_.motion.forecast(reference, frame.stamp_ns, max_acceleration);
  known_motion_ = forecast.known;
  place_unknown_ = !known_motion_;
  if (!known_motion_) {
    hypotheses_ = likely_unknown(reference, frame, past_.affine, forecast.last);
    return;
  }
  const KnownMotion& known = *known_motion_;
  hypotheses_ = {known.expected, known.after(2.0 * known.steps), known.after(0.5 * known.steps),
                 known.last, SE3()};
}

std::vector<SE3> DirectOdometry::likely_unknown(const TrackingReference& reference,
                                                const MonoFrame& frame, const Affine& affine,
                                                const SE3& around) {
  return tracker_.rank(reference, *frame.pyramid, frame.exposure_s, affine,
                       unknown_motions(around, reference.mean_rho, kUnknownShares), kMotionsKept);
}

TrackingResult DirectOdometry::track_from_any(const TrackingReference& reference,
                                              const MonoFrame& frame,
                                              std::span<const SE3> hypotheses,
                                              const std::optional<SE3>& expected) {
  LastTracking last = past_.tracking;
  last.expected = expected;
  TrackingResult out =
      tracker_.track(reference, *frame.pyramid, frame.exposure_s, past_.affine, hypotheses, last);
  const SE3& found = out.T_current_reference;
  if (out.good && known_motion_ && !is_reachable(*known_motion_, found)) {
    out.good = false;
    out.out_of_reach = true;
  }
  // The first hypothesis is where the camera is expected or recognized, if anything tells that.
  const bool near_expected =
      !place_unknown_ && is_near(found * hypotheses_.front().inverse(), reference.mean_rho);
  const double farthest = place_unknown_ ? kFarthestUnknown : 1.0;
  if (!near_expected && !is_near(found, reference.mean_rho, farthest)) out.good = false;
  return out;
}

TrackingResult DirectOdometry::track_likely(const TrackingReference& reference,
                                            const MonoFrame& frame, const KnownMotion& known) {
  TrackingResult out = track_from_any(reference, frame, hypotheses_, known.expected);
  LastTracking last = past_.tracking;
  last.expected = known.expected;
  const auto refine_from = [&](const SE3& start) {
    const TrackingResult refined =
        tracker_.refine(reference, *frame.pyramid, frame.exposure_s, past_.affine, start, last);
    const bool reached = refined.good && is_reachable(known, refined.T_current_reference);
    if (reached && (!out.good || is_likelier(reference, known, refined, out))) out = refined;
  };
  const SE3 found = out.T_current_reference;
  if (!is_nearly(found, known.expected, reference.mean_rho)) refine_from(known.expected);
  // Far points tell how the camera turned, and hardly where it is.
  if (out.inliers > 0 && deviation(known, found) > 1.0) refine_from(expected_place(known, found));
  return out;
}

/// On an open road nearly everything is far, and agrees wherever the camera is. The little that is
/// near is lost on coarse levels: fine ones are aligned from places so close together that one
/// leads to the right one, and what tells is how well the patterns around all points fit.
TrackingResult DirectOdometry::search_ahead(const TrackingReference& reference,
                                            const MonoFrame& frame, TrackingResult found) {
  const bool rolling = !reference.shift.none() || !frame.shift.none();
  const ReferenceLevel patterns =
      rolling ? reference.levels[0]
              : with_patterns(reference.levels[0], reference.pyramid->level(0));
  const auto unexplained = [&](const TrackingResult& pose) {
    return tracker_.unexplained(reference, patterns, frame.pyramid->level(0), frame.exposure_s,
                                pose);
  };
  double least = unexplained(found);
  const SE3 turn(found.T_current_reference.rotation(), Vec3::Zero());
  const Affine affine = found.affine;
  const std::vector<SE3> starts =
      unknown_translations(turn, reference.mean_rho, kUnknownShares, kAheadStep);
  for (const SE3& start : tracker_.likeliest(reference, *frame.pyramid, frame.exposure_s, affine,
                                             starts, kStartsAhead)) {
    const TrackingResult tried =
        tracker_.refine(reference, *frame.pyramid, frame.exposure_s, affine, start, past_.tracking);
    const SE3& T_tried = tried.T_current_reference;
    if (!tried.good || !is_near(T_tried, reference.mean_rho, kFarthestUnknown)) continue;
    const double rest = unexplained(tried);
    if (rest < least) {
      least = rest;
      found = tried;
    }
  }
  return found;
}

TrackingResult DirectOdometry::align(const TrackingReference& reference, const MonoFrame& frame) {
  if (!known_motion_) return track_from_any(reference, frame, hypotheses_, std::nullopt);
  TrackingResult likely = track_likely(reference, frame, *known_motion_);
  if (likely.good && likely.as_expected) return likely;
  const std::vector<SE3> knocked =
      tracker_.rank(reference, *frame.pyramid, frame.exposure_s, past_.affine,
                    knocked_motions(*known_motion_, reference.levels.back().camera), kMotionsKept);
  // The best of so many starts that leads to where the motion led is not there by chance.
  const bool confirms = !likely.good && likely.inliers > 0;
  TrackingResult found = track_from_any(
      reference, frame, knocked, confirms ? likely.T_current_reference : known_motion_->expected);
  const bool better =
      likely.good ? found.good && found.rmse < likely.rmse : found.good || found.out_of_reach;
  return better ? found : likely;
}

TrackedFrame DirectOdometry::track(const MonoFrame& frame, double max_acceleration) {
  auto ref = tracking_reference();
  past_before_ = past_;
  find_motion_hypotheses(*ref, frame, max_acceleration);
  return track_hypotheses(frame, std::move(ref));
}

TrackedFrame DirectOdometry::track_again(const MonoFrame& frame, const TrackedFrame& before) {
  past_ = past_before_;
  place_unknown_ = false;
  hypotheses_ = {before.tracking.T_current_reference};
  return track_hypotheses(frame,
                          std::static_pointer_cast<const TrackingReference>(before.reference));
}

TrackedFrame DirectOdometry::track_from(const MonoFrame& frame, const SE3& T_current_reference) {
  past_kept_ = past_;
  if (past_.motion.last_stamp_ns() == frame.stamp_ns) past_ = past_before_;
  past_before_ = past_;
  known_motion_.reset();
  place_unknown_ = false;
  hypotheses_ = {T_current_reference};
  return track_hypotheses(frame, tracking_reference());
}

TrackedHistory DirectOdometry::compare_with_past(const TrackingReference& reference,
                                                 const MonoFrame& frame,
                                                 const TrackingResult& tracked) {
  constexpr double kForget = 0.9;  // a frame: a scene of weaker texture is soon the measure
  if (!past_.has_first_rmse || past_.first_rmse_keyframe != reference.keyframe_id) {
    past_.first_rmse = tracked.rmse;
    past_.first_rmse_keyframe = reference.keyframe_id;
    past_.has_first_rmse = true;
  }
  past_.sharpest = std::max(kForget * past_.sharpest, tracked.sharpness);
  TrackedHistory out{.first_rmse = past_.first_rmse};
  out.young = window_.size() < config_.keyframe.max_keyframes;
  out.blurred = tracked.sharpness < config_.keyframe.blurred_sharpness * past_.sharpest;
  if (const auto last_stamp_ns = past_.motion.last_stamp_ns()) {
    const double since_last = seconds_between(*last_stamp_ns, frame.stamp_ns);
    out.frames = std::max(1.0, seconds_between(reference.stamp_ns, frame.stamp_ns) / since_last);
  }
  return out;
}

/// The reference as it will be seen where a frame should be: its rows at their instants, and
/// without what is then behind things that move along with the camera.
TrackingReference DirectOdometry::as_seen(const TrackingReference& reference, const ViewShift& rows,
                                          const SE3& T_current_reference) const {
  const bool rolling = !reference.shift.none() || !rows.none();
  TrackingReference out =
      rolling ? moved_by_shift(reference, rows, T_current_reference) : reference;
  if (out.co_moving.empty()) return out;
  return without_hidden(out, ImageCells(config_.co_moving.cell, camera_.width, camera_.height),
                        out.co_moving, T_current_reference);
}

TrackedFrame DirectOdometry::track_hypotheses(const MonoFrame& frame,
                                              std::shared_ptr<const TrackingReference> reference) {
  const TrackingReference& ref = *reference;
  TrackedFrame out;
  out.frame = frame;
  const bool rolling = !ref.shift.none() || !frame.shift.none();
  const TrackingResult tracking =
      rolling || !ref.co_moving.empty()
          ? align_whole_or_rest(as_seen(ref, frame.shift, hypotheses_.front()), frame, &out.views)
          : align_whole_or_rest(ref, frame, &out.views);
  out.tracking = static_cast<const FrameTracking&>(tracking);
  out.reference = std::move(reference);
  if (!tracking.good) return out;

  const TrackedHistory history = compare_with_past(ref, frame, tracking);
  past_.tracking = {tracking.rmse, tracking.inlier_ratio};
  past_.affine = tracking.affine;
  out.affine = tracking.affine;
  out.T_world_camera = ref.T_world_camera * tracking.T_current_reference.inverse();
  out.covariance = covariance_of(tracking, ref.gradient_scatter);
  const PointMotion motion =
      motion_of_points(ref.levels[0], tracking.T_current_reference,
                       config_.keyframe.max_translation_flow * pixels_for_one_of_vga(camera_));
  out.wants_keyframe =
      wants_keyframe(config_.keyframe, camera_, ref, tracking, motion, frame.exposure_s, history);
  past_.motion.note(ref, tracking.T_current_reference, frame.stamp_ns);
  return out;
}

}  // namespace sovo
