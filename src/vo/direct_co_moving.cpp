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
constexpr double kLeastInView = 0.5;  ///< Share of the rest that has to be in view for it.
// With fewer inliers, and hardly any points that moved, the frame does not fit the map.
constexpr double kFitsBadly = 0.85;
constexpr std::size_t kLeastRest = 100;  ///< Points.
// Motions of a map's second frame to try beside a body, in mean depths of the rest.
constexpr double kStepAround = 0.02;
constexpr int kStepsAround = 5;            ///< To either side along each axis.
constexpr double kFarthestAround = 0.3;    ///< What leads farther fits by chance.
constexpr std::size_t kStartsAround = 44;  ///< Of all of them, those that fit best as they are.
constexpr int kOftenFailed = 4;            ///< Then frames are left out, the more the oftener,
constexpr int kMostFailed = 8;             ///< until it is every 16th one that is looked at.

/// Share of the points that must be where a camera at rest sees them, or one that goes on from rest
/// where it `stood`, by the share that is where a pose takes them; `leaps`: far from the last one.
double enough_stays(bool stood, bool leaps, double moved) {
  if (!stood) return std::max(kLeastStays, kMoreStays * moved);
  if (!leaps) return std::max(kLeastStays, kMoreStood * moved);
  return std::max(kLeastBeforeLeap, kMoreBeforeLeap * moved);
}

/// What brightness does from the reference to a frame.
BrightnessTransfer transfer_to(const TrackingReference& reference, const MonoFrame& frame,
                               const Affine& affine) {
  return brightness_transfer(reference.affine, reference.exposure_s, affine, frame.exposure_s);
}

/// A reference without some squares, with the mean inverse depth of what is left, if that is
/// enough to align.
std::optional<TrackingReference> rest_of(const TrackingReference& reference,
                                         const ImageCells& cells, const ChosenCells& left_out) {
  TrackingReference rest = without(reference, cells, left_out);
  const auto& rho = rest.levels[0].rho;
  if (rho.size() < kLeastRest) return {};
  rest.mean_rho = std::reduce(rho.begin(), rho.end(), 0.0) / static_cast<double>(rho.size());
  return rest;
}

/// Whether the rest speaks against a pose.
bool is_contradicted(const CoarseTracker::Fit& before) { return before.misfits >= kMisfits; }

/// Whether the rest agrees with the motion that was `found`, and did not with the pose `before`.
bool fits_instead(const CoarseTracker::Fit& before, const TrackingResult& found) {
  return is_contradicted(before) &&
         found.inlier_ratio >= std::max(kFits, 1.0 - kLess * before.misfits);
}

/// Whether the motion that was `found` leaves much less of the rest unexplained.
bool fits_better(const CoarseTracker::Fit& before, const CoarseTracker::Fit& now,
                 const TrackingResult& found) {
  return found.inlier_ratio >= kFitsBetter && now.energy <= kLessEnergy * before.energy;
}

}  // namespace

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
  const BrightnessTransfer transfer = transfer_to(reference, frame, found.affine);
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
  const ChosenCells staying =
      staying_cells(config_.co_moving, cells, reference, frame.pyramid->level(0),
                    transfer_to(reference, frame, before->affine));
  const std::optional<TrackingReference> rest = rest_of(reference, cells, staying);
  if (!rest) return {};
  const CoarseTracker::Fit fit = fit_of(*rest, frame, *before);
  const bool moves = before->motion_denied;
  if (!moves && !starts && !is_contradicted(fit)) return {};
  const TrackingResult found = track_rest(*rest, frame, *before, starts);
  if (!found.good) return {};
  const SE3& T_found = found.T_current_reference;
  const bool confirmed = moves && is_nearly(T_found, before->T_current_reference, rest->mean_rho);
  if (moves) before->motion_denied = !confirmed;
  const bool better = fits_better(fit, fit_of(*rest, frame, found), found);
  const bool taken = moves ? better : fits_instead(fit, found) || (starts && better);
  // A right motion of a map's second frame shows at once what moves along.
  const bool shows = !taken && confirmed && place_unknown_ && found.inlier_ratio >= kFitsBetter;
  if (!taken && !shows) return {};
  const auto find = [&](const ChosenCells& stayed) {
    *co_moving = co_moving_cells(config_.co_moving, cells, reference, T_found, stayed);
    return std::ranges::count(*co_moving, 1) > 0;
  };
  // Beyond doubt stays what the motion should have taken away.
  const bool any =
      (!shows && find(staying)) || ((shows || starts) && find(staying_of(reference, frame, found)));
  if (!any && (!moves || shows)) return {};
  return track_without(reference, frame, *co_moving, T_found, before->affine, starts);
}

TrackingResult DirectOdometry::track_rest(const TrackingReference& rest, const MonoFrame& frame,
                                          const TrackingResult& before, bool starts) {
  const std::vector<SE3> motions =
      likely_unknown(rest, frame, before.affine, before.T_current_reference);
  const TrackingResult found =
      tracker_.track(rest, *frame.pyramid, frame.exposure_s, before.affine, motions, {});
  return starts ? search_around(rest, frame, before, search_ahead(rest, frame, found)) : found;
}

TrackingResult DirectOdometry::search_around(const TrackingReference& rest, const MonoFrame& frame,
                                             const TrackingResult& standing, TrackingResult found) {
  const auto unexplained = [&](const TrackingResult& pose) {
    const CoarseTracker::Fit fit = fit_of(rest, frame, pose);
    return std::sqrt(fit.energy) / std::max(fit.correlation * fit.correlation, 1e-6);
  };
  double least = found.good ? unexplained(found) : std::numeric_limits<double>::infinity();
  const std::vector<SE3> grid =
      translations_around(standing.T_current_reference, rest.mean_rho, kStepAround, kStepsAround);
  for (const SE3& start : tracker_.likeliest(rest, *frame.pyramid, frame.exposure_s,
                                             standing.affine, grid, kStartsAround)) {
    TrackingResult tried =
        tracker_.refine(rest, *frame.pyramid, frame.exposure_s, standing.affine, start, {});
    tried.good = is_believed_beside(rest, frame, tried);
    if (!tried.good || !is_near(tried.T_current_reference, rest.mean_rho, kFarthestAround))
      continue;
    const double left = unexplained(tried);
    if (left < least) {
      least = left;
      found = tried;
    }
  }
  return found;
}

bool DirectOdometry::is_believed_beside(const TrackingReference& rest, const MonoFrame& frame,
                                        const TrackingResult& tracked) {
  return tracked.inlier_ratio >= kFitsBetter && tracked.view_ratio >= kLeastInView &&
         tracked.rmse < config_.tracker.max_rmse &&
         fit_of(rest, frame, tracked).correlation > config_.tracker.min_correlation;
}

std::optional<TrackingResult> DirectOdometry::track_without(const TrackingReference& reference,
                                                            const MonoFrame& frame,
                                                            const ChosenCells& co_moving,
                                                            const SE3& from, const Affine& affine,
                                                            bool starts) {
  const ImageCells cells(config_.co_moving.cell, camera_.width, camera_.height);
  const TrackingReference world = without(reference, cells, co_moving);
  TrackingResult out =
      tracker_.track(world, *frame.pyramid, frame.exposure_s, affine, std::array{from}, {});
  if (starts && !out.good) out.good = is_believed_beside(world, frame, out);
  const bool reached = !known_motion_ || is_reachable(*known_motion_, out.T_current_reference);
  return out.good && reached ? std::optional(out) : std::nullopt;
}

CoarseTracker::Fit DirectOdometry::fit_of(const TrackingReference& reference,
                                          const MonoFrame& frame, const TrackingResult& tracked) {
  return tracker_.fit(reference, frame.pyramid->level(0), tracked.T_current_reference,
                      transfer_to(reference, frame, tracked.affine));
}

bool DirectOdometry::is_doubtful(const TrackingReference& reference, const MonoFrame& frame,
                                 TrackingResult* whole) {
  if (!config_.co_moving.enable || !whole->good) return false;
  if (is_at_rest(*whole, reference)) {
    bool doubtful = whole->inlier_ratio < kFitsWhole;
    for (const int halvings : {1, 2}) {
      const ImageChange change =
          image_change(*reference.pyramid, *frame.pyramid, whole->rmse, halvings);
      whole->rest_denied |=
          past_.rest_denial.holds(change, reference.levels[0], reference.keyframe_id, halvings);
      doubtful |= may_deny_rest(change);
    }
    return doubtful;
  }
  past_.rest_denial.clear();
  const MotionEvidence evidence = evidence_of(reference, frame, *whole);
  whole->motion_denied = evidence.is_doubtful() || evidence.is_missing();
  return whole->motion_denied;
}

MotionEvidence DirectOdometry::evidence_of(const TrackingReference& reference,
                                           const MonoFrame& frame, const TrackingResult& tracked) {
  return motion_check_.of(reference, frame.pyramid->level(0), tracked.T_current_reference,
                          transfer_to(reference, frame, tracked.affine));
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

}  // namespace sovo
