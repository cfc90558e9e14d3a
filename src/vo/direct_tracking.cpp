#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "sovo/vo/direct_odometry.h"
#include "sovo/vo/image_change.h"
#include "sovo/vo/keyframe_policy.h"
#include "sovo/vo/motion_hypotheses.h"
#include "sovo/vo/staying_cells.h"

namespace sovo {

namespace {

constexpr std::size_t kMotionsKept = 4;
// When a frame fits as if the camera were at rest, but for much of it.
constexpr double kFitsWhole = 0.9;  ///< Share of points that agree when nothing is amiss.
constexpr double kAtRest = 1.5;     ///< RMS flow of a camera at rest [px of a VGA image].
constexpr double kMisfits = 0.3;    ///< Share of the rest that does not agree with that,
constexpr double kFits = 0.8;       ///< and of it that agrees with its own motion,
constexpr double kLess = 0.5;       ///< when misfits come down to this share.
// When the camera may be at rest, and something else moves.
constexpr double kNearRest = 6.0;    ///< RMS flow of a pose that may be wrong by that [px of VGA].
constexpr double kLeastStays = 0.3;  ///< Share of points that are where they were, and that over
constexpr double kMoreStays = 1.15;  ///< the share of those that are where the pose takes them,
constexpr double kMoreStood = 0.8;   ///< the latter once it stood.
constexpr double kLeastBeforeLeap = 0.2;  ///< The same two where the pose leaps from there.
constexpr double kMoreBeforeLeap = 0.6;
// When much agrees better in its place than where the motion takes it.
constexpr double kFitsBetter = 0.75;  ///< Share of the rest that agrees with another motion,
constexpr double kLessEnergy = 0.6;   ///< which brings its energy down to this share.
// With fewer inliers, and hardly any points that moved, the frame does not fit the map.
constexpr double kFitsBadly = 0.85;
constexpr std::size_t kLeastRest = 100;  ///< Points.
constexpr int kOftenFailed = 4;          ///< Then frames are left out, the more the oftener,
constexpr int kMostFailed = 8;           ///< until it is every 16th one that is looked at.
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

/// Whether two motions differ by a pixel or so.
bool is_nearly(const SE3& a, const SE3& b, double mean_rho) {
  constexpr double kTurn = 0.005;   // [rad]
  constexpr double kShift = 0.005;  // mean depths
  const SE3 difference = a * b.inverse();
  return difference.rotation().log().norm() < kTurn &&
         difference.translation().norm() * mean_rho < kShift;
}

/// Share of the points that must be where a camera at rest sees them, or one that goes on from rest
/// where it `stood`, by the share that is where a pose takes them; `leaps`: far from the last one.
double enough_stays(bool stood, bool leaps, double moved) {
  if (!stood) return std::max(kLeastStays, kMoreStays * moved);
  if (!leaps) return std::max(kLeastStays, kMoreStood * moved);
  return std::max(kLeastBeforeLeap, kMoreBeforeLeap * moved);
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
    hypotheses_ = tracker_.rank(reference, *frame.pyramid, frame.exposure_s, past_.affine,
                                unknown_motions(forecast.last, reference.mean_rho, kUnknownShares),
                                kMotionsKept);
    return;
  }
  const KnownMotion& known = *known_motion_;
  hypotheses_ = {known.expected, known.after(2.0 * known.steps), known.after(0.5 * known.steps),
                 known.last, SE3()};
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

double DirectOdometry::flow_of(const SE3& T_current_reference,
                               const TrackingReference& reference) const {
  const PointMotion motion = motion_of_points(reference.levels[0], T_current_reference,
                                              std::numeric_limits<double>::infinity());
  return motion.flow_total / pixels_for_one_of_vga(camera_);
}

bool DirectOdometry::is_at_rest(const TrackingResult& tracked,
                                const TrackingReference& reference) const {
  return tracked.good && flow_of(tracked.T_current_reference, reference) < kAtRest;
}

TrackingResult DirectOdometry::found_or_at_rest(const TrackingReference& reference,
                                                const MonoFrame& frame, TrackingResult found) {
  if (!config_.co_moving.enable || !found.good) return found;
  const bool stood = std::exchange(past_.stands, past_.stands && is_at_rest(found, reference));
  const SE3 last = stood && known_motion_ ? known_motion_->last : SE3();
  const bool leaps = flow_of(found.T_current_reference * last.inverse(), reference) > kNearRest;
  if (!stood && leaps) return found;
  const ImageF& image = frame.pyramid->level(0);
  const BrightnessTransfer transfer =
      brightness_transfer(reference.affine, reference.exposure_s, found.affine, frame.exposure_s);
  const auto share = [&](const SE3& T_current_reference) {
    return agreeing_share(config_.co_moving, reference, image, T_current_reference, transfer);
  };
  const double enough = enough_stays(stood, leaps, share(found.T_current_reference));
  const bool at_rest = share(SE3()) >= std::max(kLeastStays, enough);
  const bool known = stood && past_.moving_keyframe == reference.keyframe_id;
  if (at_rest ? !note_moving(reference, image, transfer) : !known) return found;
  TrackingResult still = track_standing(reference, frame, found.affine, last);
  if (!still.good || (!stood && !is_at_rest(still, reference))) return found;
  const SE3& T_still = still.T_current_reference;
  if (share(T_still) < enough) {
    past_.stands |= stood && is_nearly(T_still, found.T_current_reference, reference.mean_rho);
    return found;
  }
  past_.stands = true;
  still.inlier_ratio = 1.0 - tracker_.fit(reference, image, T_still, transfer).misfits;
  return still;
}

bool DirectOdometry::note_moving(const TrackingReference& reference, const ImageF& image,
                                 const BrightnessTransfer& transfer) {
  const ImageCells cells(config_.co_moving.cell, camera_.width, camera_.height);
  ChosenCells moving = staying_cells(config_.co_moving, cells, reference, image, transfer);
  if (stays_nearer(cells, reference, moving)) return false;
  for (auto& cell : moving) cell = cell == 0 ? 1 : 0;
  past_.moving = std::move(moving);
  past_.moving_keyframe = reference.keyframe_id;
  return true;
}

TrackingResult DirectOdometry::track_standing(const TrackingReference& reference,
                                              const MonoFrame& frame, const Affine& affine,
                                              const SE3& last) {
  const ImageCells cells(config_.co_moving.cell, camera_.width, camera_.height);
  TrackingResult out = tracker_.track(without(reference, cells, past_.moving), *frame.pyramid,
                                      frame.exposure_s, affine, std::array{last}, {});
  if (known_motion_ && !is_reachable(*known_motion_, out.T_current_reference)) out.good = false;
  return out;
}

std::optional<TrackingResult> DirectOdometry::align_rest(const TrackingReference& reference,
                                                         const MonoFrame& frame, bool starts,
                                                         TrackingResult* before,
                                                         ChosenCells* co_moving) {
  const ImageCells cells(config_.co_moving.cell, camera_.width, camera_.height);
  const ImageF& image = frame.pyramid->level(0);
  const auto transfer = [&](const Affine& affine) {
    return brightness_transfer(reference.affine, reference.exposure_s, affine, frame.exposure_s);
  };
  const ChosenCells staying =
      staying_cells(config_.co_moving, cells, reference, image, transfer(before->affine));
  TrackingReference rest = without(reference, cells, staying);
  const std::size_t points = rest.levels[0].size();
  if (points < kLeastRest) return {};
  rest.mean_rho = std::reduce(rest.levels[0].rho.begin(), rest.levels[0].rho.end(), 0.0) /
                  static_cast<double>(points);
  const SE3& T_before = before->T_current_reference;
  const auto fit = tracker_.fit(rest, image, T_before, transfer(before->affine));
  const bool moves = before->motion_denied;
  const bool contradicted = fit.misfits >= kMisfits;
  if (!moves && !contradicted && !starts) return {};
  const auto track = [&](const TrackingReference& against, std::span<const SE3> motions) {
    return tracker_.track(against, *frame.pyramid, frame.exposure_s, before->affine, motions, {});
  };
  TrackingResult found = track(
      rest, tracker_.rank(rest, *frame.pyramid, frame.exposure_s, before->affine,
                          unknown_motions(T_before, rest.mean_rho, kUnknownShares), kMotionsKept));
  if (starts) found = search_ahead(rest, frame, found);
  if (!found.good) return {};
  const SE3& T_found = found.T_current_reference;
  const auto now = tracker_.fit(rest, image, T_found, transfer(found.affine));
  const bool better = found.inlier_ratio >= kFitsBetter && now.energy <= kLessEnergy * fit.energy;
  const bool agrees =
      contradicted && found.inlier_ratio >= std::max(kFits, 1.0 - kLess * fit.misfits);
  const bool confirmed = moves && is_nearly(T_found, T_before, rest.mean_rho);
  if (moves) before->motion_denied = !confirmed;
  const bool taken = moves ? better : agrees || (starts && better);
  // A right motion of a map's second frame shows at once what moves along.
  const bool shows = !taken && confirmed && place_unknown_ && found.inlier_ratio >= kFitsBetter;
  if (!taken && !shows) return {};
  const ChosenCells beyond_doubt = shows ? staying_of(reference, frame, found) : staying;
  *co_moving = co_moving_cells(config_.co_moving, cells, reference, T_found, beyond_doubt);
  if ((!moves || shows) && std::ranges::count(*co_moving, 1) == 0) return {};
  // What stays in its place since it is far tells of the motion, too.
  const TrackingResult out = track(without(reference, cells, *co_moving), std::array{T_found});
  const bool reached = !known_motion_ || is_reachable(*known_motion_, out.T_current_reference);
  return out.good && reached ? std::optional(out) : std::nullopt;
}

bool DirectOdometry::is_doubtful(const TrackingReference& reference, const MonoFrame& frame,
                                 TrackingResult* whole) {
  if (!config_.co_moving.enable || !whole->good) return false;
  if (is_at_rest(*whole, reference)) {
    const ImageChange change = image_change(*reference.pyramid, *frame.pyramid, whole->rmse);
    whole->rest_denied = denies_rest(change, reference.levels[0]);
    return whole->inlier_ratio < kFitsWhole || may_deny_rest(change);
  }
  const MotionEvidence evidence = evidence_of(reference, frame, *whole);
  whole->motion_denied = evidence.is_doubtful() || evidence.is_missing();
  return whole->motion_denied;
}

MotionEvidence DirectOdometry::evidence_of(const TrackingReference& reference,
                                           const MonoFrame& frame, const TrackingResult& tracked) {
  return motion_check_.of(reference, frame.pyramid->level(0), tracked.T_current_reference,
                          brightness_transfer(reference.affine, reference.exposure_s,
                                              tracked.affine, frame.exposure_s));
}

std::optional<TrackingResult> DirectOdometry::start_beside_body(
    const TrackingReference& reference, const MonoFrame& frame, const TrackingResult& near,
    std::shared_ptr<const FrameViews>* views) {
  if (!config_.co_moving.enable || !place_unknown_) return {};
  TrackingResult standing;
  standing.affine = past_.affine;
  if (near.good) standing = near;
  if (flow_of(standing.T_current_reference, reference) > kNearRest) return {};
  auto view = std::make_shared<CoMovingView>();
  const auto moved = align_rest(reference, frame, true, &standing, &view->cells);
  if (moved) *views = std::move(view);
  return moved;
}

ChosenCells DirectOdometry::staying_of(const TrackingReference& reference, const MonoFrame& frame,
                                       const TrackingResult& tracked) {
  evidence_of(reference, frame, tracked);
  return motion_check_.staying();
}

TrackingResult DirectOdometry::align_whole_or_rest(const TrackingReference& reference,
                                                   const MonoFrame& frame,
                                                   std::shared_ptr<const FrameViews>* views) {
  const TrackingResult near = found_or_at_rest(reference, frame, align(reference, frame));
  if (const auto moved = start_beside_body(reference, frame, near, views)) return *moved;
  const TrackingResult found = whole_or_rest(reference, frame, near, views);
  if (!place_unknown_ || !found.good || *views != nullptr) return found;
  const TrackingResult better = search_ahead(reference, frame, found);
  const bool same =
      is_nearly(better.T_current_reference, found.T_current_reference, reference.mean_rho);
  if (same) return found;
  if (const auto moved = start_beside_body(reference, frame, better, views)) return *moved;
  return whole_or_rest(reference, frame, better, views);
}

TrackingResult DirectOdometry::whole_or_rest(const TrackingReference& reference,
                                             const MonoFrame& frame, TrackingResult whole,
                                             std::shared_ptr<const FrameViews>* views) {
  if (!is_doubtful(reference, frame, &whole)) {
    past_.rest_failed = past_.rest_waits = 0;
    past_.motion_confirmed = false;
    return whole;
  }
  const bool moves = whole.motion_denied;
  const bool denied = whole.rest_denied || (moves && !past_.motion_confirmed);
  if (--past_.rest_waits > 0 && !denied) {
    whole.motion_denied = false;
    return whole;
  }
  auto view = std::make_shared<CoMovingView>();
  if (const auto moved = align_rest(reference, frame, false, &whole, &view->cells)) {
    *views = std::move(view);
    return *moved;
  }
  past_.motion_confirmed = moves && !whole.motion_denied;
  if (whole.motion_denied && whole.inlier_ratio < kFitsBadly &&
      evidence_of(reference, frame, whole).is_missing()) {
    whole.good = false;
  }
  past_.rest_failed = std::min(past_.rest_failed + 1, kMostFailed);
  past_.rest_waits = past_.rest_failed < kOftenFailed ? 0 : 1 << (past_.rest_failed - kOftenFailed);
  return whole;
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
