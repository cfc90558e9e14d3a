#include "sovo/odometry/map_segment.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "sovo/image/halving.h"
#include "sovo/odometry/map_stage.h"
#include "sovo/odometry/new_backend.h"
#include "sovo/odometry/pixel_matching.h"
#include "sovo/odometry/trajectory_recorder.h"

namespace sovo {

namespace {

/// Frames from one search for stereo depth to the next while the map begins: two views take their
/// time, and meanwhile a camera may be uncovered, or come to another texture.
constexpr std::uint32_t kStereoEvery = 5;
/// Of a camera of which nothing is known yet [m/s].
constexpr double kUnknownSpeed = 1.0;
/// Exposures that are no farther apart are as good as one: nothing moves meanwhile.
constexpr std::int64_t kAtOnceNs = 1'000'000;
/// Share of the pixels that agree. Of flights with a turned right camera hardly ever have two
/// keyframes in a row less, under strong caustics nearly all have.
constexpr double kFitsBadly = 0.77;
/// So many keyframes wait for a scale, the newest ones: a map may go without one for days.
constexpr std::size_t kMostWaiting = 200;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Gives `keyframe` its points, with the grey levels of its image, which is halved so often.
void set_points(const KeyframePoints& points, const ImageF& image, int halvings,
                KeyframeOutput* keyframe) {
  keyframe->u = points.u;
  keyframe->v = points.v;
  for (auto* positions : {&keyframe->u, &keyframe->v}) {
    for (float& x : *positions) x = from_halved(x, halvings);
  }
  keyframe->inverse_depth = points.inverse_depth;
  keyframe->sigma = points.sigma;
  keyframe->intensity.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const int x = std::clamp(static_cast<int>(points.u[i] + 0.5F), 0, image.width() - 1);
    const int y = std::clamp(static_cast<int>(points.v[i] + 0.5F), 0, image.height() - 1);
    const float grey = std::clamp(image.at(x, y), 0.0F, 255.0F);
    keyframe->intensity.push_back(static_cast<std::uint8_t>(grey));
  }
}

/// What a flat port does is known in metres, which a map may not be made of yet.
MonoFrame without_metres(MonoFrame frame) {
  frame.shift.axial = {};
  return frame;
}

}  // namespace

MapSegment::MapSegment(const StereoOdometryConfig& config, const FramePreparation& preparation,
                       std::uint32_t index, int halvings, const RightTurn& right_turn,
                       WorkerPool* pool, StageObserver* observer)
    : config_(config),
      preparation_(preparation),
      index_(index),
      halvings_(halvings),
      pool_(pool),
      observer_(observer),
      vo_(new_backend(config, rig().left, preparation.left_mask(halvings), halvings, pool,
                      preparation.light_observers())),
      right_(config.matcher, rig(), right_turn),
      readout_motion_(preparation),
      optimizer_(config.scale, rig()),
      filter_(config.filter),
      assist_(config.assist) {}

bool MapSegment::initialize(const MonoFrame& frame, const SideImage* right,
                            const SE3& T_odom_left) {
  const bool only_stereo = config_.init == InitMethod::kStereo;
  const bool due = only_stereo || attempts_ % kStereoEvery == 0;
  ++attempts_;
  stereo_quality_.reset();
  if (config_.init != InitMethod::kTwoView && right != nullptr && due) {
    if (initialize_from_stereo(frame, *right, T_odom_left)) {
      two_view_initializer_.reset();
      two_view_first_.reset();
      return true;
    }
  }
  if (!only_stereo) return initialize_from_two_views(without_metres(frame), right, T_odom_left);
  if (right == nullptr) reason_ = "waiting for a right image to begin from stereo depth";
  return false;
}

ImagePyramidPtr MapSegment::prepare_right(const SideImage& right, const MonoFrame& frame) {
  auto pyramid = right_pyramids_.take();
  preparation_.prepare_right(right, halvings_, frame, pyramid.get());
  return pyramid;
}

Halving MapSegment::halving(bool noise_broke) const {
  if (!stereo_quality_) return {};
  if (!initialized_ && attempts_ > kStereoEvery) return {preparation_.max_halvings(), false};
  const bool doubtful = is_noisy() && (!initialized_ || noise_broke);
  if (config_.init != InitMethod::kAuto || !doubtful) return {};
  return {std::min(1, preparation_.max_halvings()), true};
}

bool MapSegment::is_noisy() const {
  return halvings_ == 0 && stereo_quality_ && stereo_quality_->is_noisy();
}

bool MapSegment::initialize_from_stereo(const MonoFrame& frame, const SideImage& right,
                                        const SE3& T_odom_left) {
  const std::vector<SelectedPixel> pixels = vo_->select_pixels(frame, vo_->wanted_points());
  const ImagePyramidPtr right_pyramid = prepare_right(right, frame);
  const StereoStart start =
      stereo_start(pixels, match_all(right_.matcher(), *frame.pyramid, *right_pyramid, pixels));
  stereo_quality_ = start.quality;
  const bool any_share = config_.init == InitMethod::kStereo;
  if (!start.quality.is_enough(any_share ? 0.0 : config_.init_min_matched)) {
    reason_ = start.quality.problem();
    return false;
  }
  // One right image decides on the scale that a map begins with; whether it is right, others tell.
  if (stereo()) vo_->use_static_residuals(right_.rig(), StaticScale::kHeld);
  T_odom_left_start_ = T_odom_left;
  scale_path_.restart(T_odom_left.translation());
  vo_->begin(frame, T_odom_left_start_, start.points,
             stereo() && right.stamp_offset_ns == 0 ? right_pyramid : nullptr);
  readout_motion_.begin(*vo_->reference());
  exposure_motion_.note(*vo_->reference(), SE3(), frame.stamp_ns);
  // Matching errors are independent; what remains is common to all: the calibration, and where the
  // right camera went until its own exposure, as no motion is known yet.
  const double moved = kUnknownSpeed * 1e-9 * static_cast<double>(right.stamp_offset_ns);
  filter_.lock_initial(std::hypot(start.scale_sigma, moved / rig().baseline()), frame.stamp_ns);
  publish_scale(nullptr, frame.stamp_ns);
  initialized_ = true;
  reason_.clear();
  MappingOutcome outcome;
  outcome.map.active_points = vo_->num_active_points();
  outcome.map.keyframes = 1;
  outcome.keyframes = {first_keyframe(frame, right_pyramid)};
  start_outcome_ = std::move(outcome);
  return true;
}

bool MapSegment::initialize_from_two_views(const MonoFrame& frame, const SideImage* right,
                                           const SE3& T_odom_left) {
  if (two_view_initializer_) {
    switch (two_view_initializer_->track(frame.stamp_ns, frame.pyramid)) {
      case TwoViewInitializer::Status::kReady:
        return finish_two_views(frame, right);
      case TwoViewInitializer::Status::kNotYet:
        reason_ = "beginning from two views: " + two_view_initializer_->reason();
        return false;
      case TwoViewInitializer::Status::kFailed:
        break;
    }
  }
  two_view_initializer_ = std::make_unique<TwoViewInitializer>();
  PixelSelectorConfig selector = config_.vo.selection;
  selector.seed = config_.seed + 1;
  two_view_selector_ = std::make_unique<PixelSelector>(selector);
  const ImageU8& mask = preparation_.left_mask(halvings_);
  two_view_first_ = frame;
  T_odom_left_start_ = T_odom_left;
  if (!two_view_initializer_->set_first(frame.stamp_ns, frame.pyramid, rig().left,
                                        mask.empty() ? nullptr : &mask, two_view_selector_.get())) {
    reason_ = "beginning from two views: " + two_view_initializer_->reason();
    two_view_initializer_.reset();
  }
  return false;
}

bool MapSegment::finish_two_views(const MonoFrame& frame, const SideImage* right) {
  const TwoViewResult& result = two_view_initializer_->result();
  std::vector<StartPoint> points;
  points.reserve(result.points.size());
  for (const InitialPoint& p : result.points) {
    StartPoint s;
    s.pixel.x = static_cast<std::int16_t>(std::lround(p.u));
    s.pixel.y = static_cast<std::int16_t>(std::lround(p.v));
    s.depth = {p.inverse_depth, std::max(p.sigma, 1e-3F * p.inverse_depth)};
    points.push_back(s);
  }
  scale_path_.restart(T_odom_left_start_.translation());
  vo_->begin(*two_view_first_, T_odom_left_start_, points, nullptr);
  TrackedFrame second = vo_->track_from(frame, result.T_newest_first);
  const MonoFrame first_frame = *std::exchange(two_view_first_, std::nullopt);
  two_view_initializer_.reset();
  if (!second.tracking.good) {
    reason_ = "beginning from two views: the second view could not be tracked";
    return false;
  }
  second.wants_keyframe = true;
  KeyframeOutput first = first_keyframe(first_frame, nullptr);
  start_outcome_ = map(second, right);
  start_outcome_->keyframes.insert(start_outcome_->keyframes.begin(), std::move(first));
  initialized_ = !start_outcome_->map.failed;
  if (initialized_) reason_.clear();
  return initialized_;
}

std::optional<MappingOutcome> MapSegment::take_start_outcome() {
  return std::exchange(start_outcome_, std::nullopt);
}

std::vector<StaticMatch> MapSegment::match_all(const StaticMatcher& matcher,
                                               const ImagePyramid& left, const ImagePyramid& right,
                                               const std::vector<SelectedPixel>& pixels) const {
  const ScopedStage stage(observer_, Stage::kStaticMatching);
  return match_pixels(matcher, left, right, pixels, pool_);
}

DepthProposer MapSegment::stereo_proposer(const ImagePyramidPtr& left, const ImagePyramid& right,
                                          const SE3& T_later_left) const {
  return [this, left, &right, matcher = right_.matcher().moved(T_later_left)](
             const std::vector<SelectedPixel>& pixels, std::vector<DepthProposal>* proposals) {
    const std::vector<StaticMatch> matches = match_all(matcher, *left, right, pixels);
    std::transform(matches.begin(), matches.end(), proposals->begin(), proposal_of);
  };
}

bool MapSegment::matches_new_pixels() const {
  if (config_.mode == OdometryMode::kMono || config_.depth_init == DepthInit::kTemporal)
    return false;
  // Static residuals need them: their images' brightness is fitted there.
  const bool held = stereo() || (config_.backend == Backend::kDirect && assist_.holds_scale());
  return config_.depth_init == DepthInit::kStereo || held || assist_.wanted();
}

std::optional<StaticScale> MapSegment::static_residuals(const SideImage& right) const {
  if (stereo()) return StaticScale::kHeld;
  if (config_.mode != OdometryMode::kScale || config_.backend != Backend::kDirect) return {};
  if (config_.depth_init == DepthInit::kTemporal) return {};
  if (assist_.holds_scale()) return StaticScale::kHeld;
  const bool at_once = std::abs(right.stamp_offset_ns) < kAtOnceNs;
  const bool free = config_.vo.window.free_static_weight > 0.0 && at_once;
  if (free && config_.depth_init == DepthInit::kStereo) return StaticScale::kFree;
  return {};
}

TrackedFrame MapSegment::track(const MonoFrame& frame) {
  const bool metric = scale_status().locked;
  return noted(metric ? vo_->track(frame, config_.max_acceleration)
                      : vo_->track(without_metres(frame), 0.0));
}

TrackedFrame MapSegment::track_from(const MonoFrame& frame, const SE3& T_current_reference) {
  return noted(vo_->track_from(frame, T_current_reference));
}

TrackedFrame MapSegment::track_again(const MonoFrame& frame, const TrackedFrame& before) {
  return noted(vo_->track_again(frame, before));
}

TrackedFrame MapSegment::noted(TrackedFrame tracked) {
  readout_motion_.note(tracked);
  return tracked;
}

MappingOutcome MapSegment::map(const TrackedFrame& tracked, const SideImage* right) {
  MappingOutcome out;
  const MapTimer timer = [this](MapStage stage, double seconds) {
    // Static matching is timed where it happens.
    if (observer_ != nullptr && stage != MapStage::kStaticMatching) {
      observer_->on_stage(stage_of(stage), seconds);
    }
  };
  ScaleJob job;
  KeyframeStereo keyframe_stereo;
  const bool use_right = tracked.wants_keyframe && right != nullptr;
  exposure_motion_.note(*tracked.reference, tracked.tracking.T_current_reference,
                        tracked.frame.stamp_ns);
  if (use_right) {
    job.T_later_left = exposure_motion_.until(right->stamp_offset_ns);
    job.turn = right_.turn();
    const auto start = std::chrono::steady_clock::now();
    job.right = prepare_right(*right, tracked.frame);
    job.pyramid_seconds = seconds_since(start);
    // Depths of an unscaled map are no metres.
    const bool metric = filter_.locked();
    if (metric && matches_new_pixels()) {
      keyframe_stereo.depths = stereo_proposer(tracked.frame.pyramid, *job.right, job.T_later_left);
    }
    keyframe_stereo.T_later_left = job.T_later_left;
    if (const auto statics = static_residuals(*right); statics && metric) {
      vo_->use_static_residuals(right_.rig(), *statics);
      keyframe_stereo.right = job.right;
    }
  }
  TrackedFrame moving = tracked;
  if (exposure_motion_.known()) moving.frame.velocity = exposure_motion_.rate_after(0.0);
  out.map = vo_->map(moving, keyframe_stereo, timer);
  broken_ = out.map.failed;
  if (!out.map.is_keyframe || out.map.failed) return out;
  assist_.on_keyframe(static_cast<double>(out.map.active_points) / vo_->wanted_points(),
                      tracked.tracking.inlier_ratio);
  held_scale_ = held_scale(out.map.bundle, config_.scale);
  if (observer_ != nullptr) {
    observer_->on_window(static_cast<std::uint32_t>(out.map.bundle.points),
                         static_cast<std::uint32_t>(out.map.bundle.residuals));
  }
  out.keyframes = {new_keyframe(job)};
  out.keyframes.front().lens = out.map.bundle.lens;
  revise_left(std::exchange(out.map.left, {}), &out.keyframes);
  if (use_right && config_.mode != OdometryMode::kMono && vo_->snapshot()) {
    job.snapshot = *vo_->snapshot();
    job.cold_start = filter_.wants_cold_start();
    const bool fits_badly =
        config_.backend == Backend::kDirect && tracked.tracking.inlier_ratio < kFitsBadly;
    job.fits_badly = std::exchange(fits_badly_, fits_badly) && fits_badly;
    out.scale_job = std::move(job);
  }
  return out;
}

ScaleEstimate MapSegment::estimate_scale(const ScaleJob& job) const {
  const auto start = std::chrono::steady_clock::now();
  const ScaleEstimate estimate =
      optimizer_.estimate(job.snapshot, *job.right, job.cold_start, job.T_later_left, job.turn);
  if (observer_ != nullptr) {
    observer_->on_stage(Stage::kScaleOptimization, job.pyramid_seconds + seconds_since(start));
  }
  return estimate;
}

ScaleRecord MapSegment::finish_scale(const ScaleJob& job, const ScaleEstimate& estimate) {
  const bool was_locked = filter_.locked();
  const double pending = vo_->log_scale() - job.snapshot.log_scale;
  ScaleMeasurement m;
  m.estimate = estimate;
  m.estimate.turn.doubtful = job.fits_badly;
  filter_.widen(right_.note(job.turn, &m.estimate));
  m.cold_start = job.cold_start;
  m.stamp_ns = job.snapshot.stamp_ns;
  m.shared_points = job.snapshot.shared_points;
  m.pending_log_scale = pending;
  const Vec3& position = job.snapshot.T_world_camera.translation();
  if (last_keyframe_position_) {
    m.distance = (position - *last_keyframe_position_).norm() * job.snapshot.mean_inverse_depth;
  }
  last_keyframe_position_ = position;

  const double sigma_before = filter_.path_sigma();
  const ScaleUpdate update = stereo() ? filter_.watch(m, held_scale_.variance) : filter_.update(m);
  const bool held = filter_.locked() && held_scale_.stands_in_for(estimate, config_.scale);
  if (held) filter_.hold(held_scale_.variance, m.stamp_ns);
  assist_.on_scale(update.verdict);
  ScaleRecord record;
  record.stamp_ns = job.snapshot.stamp_ns;
  record.keyframe_id = job.snapshot.id;
  record.measured = estimate.log_scale;
  record.sigma = estimate.sigma;
  record.verdict = update.verdict;
  record.residual = estimate.residual;
  if (update.apply) {
    ScaleCorrection correction;
    correction.keyframe_id = job.snapshot.id;
    correction.scale_epoch = job.snapshot.scale_epoch;
    correction.log_scale = pending + update.log_scale_correction;
    correction.first_lock = !was_locked;
    record.correction = vo_->apply(correction);
    if (correction.first_lock) refined_until_ = 0;  // it rescales what was built before
  }
  if (was_locked) {
    // Of the scale that the camera came here with: a correction leaves the newest keyframe in its
    // place.
    scale_path_.extend(position, sigma_before);
  } else if (filter_.locked()) {
    // All that was built before took this scale at once, about the newest keyframe.
    const Vec3 since = position - T_odom_left_start_.translation();
    scale_path_.restart(position - std::exp(record.correction) * since);
    scale_path_.extend(position, filter_.path_sigma());
  }
  const bool watched = stereo() && update.verdict == ScaleVerdict::kAccepted;
  const bool known = update.apply || watched || held;
  publish_scale(&record, known ? std::optional(record.stamp_ns) : std::nullopt);
  return record;
}

void MapSegment::publish_scale(const ScaleRecord* record, std::optional<std::int64_t> accepted_ns) {
  const std::lock_guard lock(status_mutex_);
  status_.locked = metric();
  status_.log_scale = vo_->log_scale();
  status_.sigma = filter_.sigma();
  status_.path = scale_path_;
  status_.decalibrated = right_.known().decalibrated();
  status_.right_turn = right_.turn();
  if (accepted_ns) status_.accepted_stamp_ns = *accepted_ns;
  if (record != nullptr) {
    status_.last_correction = record->correction;
    status_.residual = record->residual;
    status_.verdict = record->verdict;
  } else if (accepted_ns) {
    status_.verdict = ScaleVerdict::kAccepted;
  }
}

ScaleStatus MapSegment::scale_status() const {
  const std::lock_guard lock(status_mutex_);
  return status_;
}

KeyframeOutput MapSegment::first_keyframe(const MonoFrame& frame,
                                          const ImagePyramidPtr& right) const {
  KeyframeOutput out = own_points(vo_->window_keyframes().front());
  out.scale_valid = metric();
  out.T_odom_left = vo_->keyframes().back().T_world_camera;
  out.left = frame.pyramid;
  out.right = right;
  out.halvings = halvings_;
  return out;
}

KeyframeOutput MapSegment::new_keyframe(const ScaleJob& job) const {
  const KeyframeSnapshot& s = *vo_->snapshot();
  KeyframeOutput out;
  out.id = s.id;
  out.segment = index_;
  out.stamp_ns = s.stamp_ns;
  out.scale_valid = metric();
  out.T_odom_left = vo_->keyframes().back().T_world_camera;
  out.log_scale = vo_->log_scale();
  set_points(s.points, s.pyramid->level(0), halvings_, &out);
  out.covariance = vo_->reference()->covariance;
  out.covariance.topLeftCorner<3, 3>() +=
      scale_status().position_covariance(out.T_odom_left.translation());
  out.left = s.pyramid;
  out.right = job.right;
  out.T_later_left = job.T_later_left_turned(rig().T_right_left);
  out.halvings = halvings_;
  if (ImageU8 mask = vo_->co_moving_mask(); !mask.empty()) {
    out.co_moving_mask = std::make_shared<const ImageU8>(std::move(mask));
  }
  return out;
}

/// The keyframe with its own points, in the unit that the map began with.
KeyframeOutput MapSegment::own_points(const KeyframeState& state) const {
  KeyframeOutput out;
  out.id = state.id;
  out.segment = index_;
  out.stamp_ns = state.stamp_ns;
  set_points(state.points, state.pyramid->level(0), halvings_, &out);
  return out;
}

/// Gives `keyframe`, as `own_points` made it, its refined pose, and its depths the scale of that:
/// similarities later than the keyframe's own are undone in both.
void MapSegment::revise(const SE3& T_odom_left, KeyframeOutput* keyframe) const {
  keyframe->revised = true;
  keyframe->scale_valid = metric();
  keyframe->T_odom_left = T_odom_left;
  keyframe->log_scale = vo_->keyframes()[keyframe->id].log_scale;
  const auto scale = static_cast<float>(std::exp(-keyframe->log_scale));
  for (float& rho : keyframe->inverse_depth) rho *= scale;
  for (float& sigma : keyframe->sigma) sigma *= scale;
}

void MapSegment::revise_left(const std::vector<KeyframeState>& left,
                             std::vector<KeyframeOutput>* out) {
  for (const KeyframeState& state : left) waiting_.push_back(own_points(state));
  if (config_.mode != OdometryMode::kMono && !metric()) {
    if (waiting_.size() > kMostWaiting) {
      waiting_.erase(waiting_.begin(), waiting_.end() - static_cast<std::ptrdiff_t>(kMostWaiting));
    }
    return;
  }
  if (waiting_.empty()) return;
  refine_keyframe_poses(vo_->keyframes(), refined_until_, &refined_);
  refined_until_ = vo_->oldest_in_window();
  for (KeyframeOutput& keyframe : waiting_) {
    revise(refined_[keyframe.id], &keyframe);
    out->push_back(std::move(keyframe));
  }
  waiting_.clear();
}

std::vector<KeyframeOutput> MapSegment::remaining_keyframes() const {
  if (!initialized_) return {};
  std::vector<KeyframeOutput> out = waiting_;
  if (!broken_) {
    for (const KeyframeState& state : vo_->window_keyframes()) out.push_back(own_points(state));
  }
  const std::vector<SE3> refined = refined_keyframe_poses(vo_->keyframes());
  for (KeyframeOutput& keyframe : out) revise(refined[keyframe.id], &keyframe);
  return out;
}

}  // namespace sovo
