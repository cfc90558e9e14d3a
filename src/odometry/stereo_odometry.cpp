#include "sovo/odometry/stereo_odometry.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <utility>

#include "sovo/geometry/pose_covariance.h"
#include "sovo/odometry/dead_reckoning.h"
#include "sovo/odometry/exposure_motion.h"
#include "sovo/odometry/frame_check.h"
#include "sovo/odometry/frame_velocity.h"
#include "sovo/odometry/frame_verdict.h"
#include "sovo/odometry/live_threads.h"
#include "sovo/odometry/map_segment.h"
#include "sovo/odometry/recent_places.h"
#include "sovo/odometry/recognized_tracking.h"
#include "sovo/odometry/trajectory_recorder.h"
#include "sovo/vo/lens_fit.h"

namespace sovo {

namespace {

constexpr double kNanosecond = 1e-9;

}  // namespace

class StereoOdometry::Impl {
 public:
  Impl(const StereoOdometryConfig& config, const StereoCameras& cameras, OutputSink* sink,
       StageObserver* observer)
      : config_(config),
        sink_(sink),
        observer_(observer),
        preparation_(config_, cameras),
        check_(preparation_),
        places_(config_, preparation_),
        pool_(config.threads) {
    if (config.backend == Backend::kFeatures && config.mode == OdometryMode::kStereo) {
      throw std::invalid_argument("the feature-based backend has no static residuals");
    }
    if (!config_.deterministic) {
      threads_ = std::make_unique<LiveThreads>(
          static_cast<std::size_t>(std::max(1, config_.mapping_queue)),
          LiveThreads::Callbacks{[this](const MappingOutcome& o) { publish_keyframes(o); },
                                 [this](const ScaleRecord& r) { sink_->on_scale(r); }});
    }
    begin_segment(new_segment(next_segment_, 0));
  }

  void process(const StereoFrame& frame) {
    const ScopedStage stage(observer_, Stage::kFrame);
    ++received_;
    OdometryOutput out = output_for(frame);
    const std::string refusal = check_.refuse(frame, [&] { return patience(frame.stamp_ns); });
    if (!refusal.empty()) {
      ++rejected_;
      fill_counters(&out);
      out.state = segment_->initialized() ? OdometryState::kDegraded : OdometryState::kInitializing;
      out.reason = refusal;
      sink_->on_frame(out);
      return;
    }
    const std::string right_problem = check_.right_problem(frame);
    SideImage right_side = frame.right;
    right_side.stamp_offset_ns = config_.exposure_motion ? exposure_offset_ns(frame) : 0;
    const SideImage* right = right_problem.empty() ? &right_side : nullptr;
    if (segment_->initialized()) {
      follow(frame, right, right_problem, &out);
    } else {
      initialize(frame, right, &out);
    }
    check_.doubt(&out);
    fill_counters(&out);
    sink_->on_frame(out);
  }

  void finish() {
    if (threads_) threads_->drain();
    for (const KeyframeOutput& k : segment_->remaining_keyframes()) sink_->on_keyframe(k);
  }

  void reset() {
    end_segment();
    ++reset_counter_;
    noise_broke_ = false;
    begin_segment(new_segment(next_segment_, 0));
  }

  std::vector<TrajectoryPose> trajectory() const {
    return recorder_.trajectory(&segment_->vo().keyframes());
  }

  SO3 right_turn() const { return segment_->right_turn().turn(); }
  const StereoRig& tracked_rig() const { return preparation_.rig(); }
  const ImageU8& tracked_mask() const { return preparation_.left_mask(); }

 private:
  /// For how long an image that stays the same is no sign of rest [s].
  double patience(std::int64_t stamp_ns) const {
    constexpr double kUnknown = 0.25;  // most maps begin at rest
    constexpr double kPixels = 0.5;
    if (!segment_->initialized()) return 0.0;
    if (followed_ == 0) return kUnknown;
    const SE3 step = reckoning_.since_last(stamp_ns);
    const double shift = step.translation().norm() * segment_->vo().reference()->mean_rho;
    const double flow = preparation_.rig().left.fx * (step.rotation().log().norm() + shift);
    return flow > kPixels ? FrameCheck::kFrozen : 0.0;
  }

  void end_segment() {
    finish();
    recorder_.close_segment(segment_->vo().keyframes());
  }

  std::unique_ptr<MapSegment> new_segment(std::uint32_t index, int halvings) {
    const RightTurn known = segment_ ? segment_->right_turn()
                                     : RightTurn(config_.right_turn, preparation_.rig().right.fx);
    return std::make_unique<MapSegment>(config_, preparation_, index, halvings, known, &pool_,
                                        observer_);
  }

  void set_segment(std::unique_ptr<MapSegment> segment) {
    if (threads_) threads_->set_segment(nullptr);
    segment_ = std::move(segment);
    if (threads_) threads_->set_segment(segment_.get());
  }

  void begin_segment(std::unique_ptr<MapSegment> segment) {
    set_segment(std::move(segment));
    ++next_segment_;
    first_frame_.reset();
    failures_ = 0;
    followed_ = 0;
    distance_ = 0.0;
    published_.reset();
  }

  void initialize(const StereoFrame& frame, const SideImage* right, OdometryOutput* out) {
    Start start{nullptr, preparation_.prepare_left(frame, observer_, segment_->halvings())};
    const SE3 T_odom_left = recognize(start.left, right).value_or(reckoning_.at(frame.stamp_ns));
    const bool begun = segment_->initialize(start.left, right, T_odom_left);
    std::string halved;
    if (halve(*segment_, segment_->halving(noise_broke_), frame, right, T_odom_left, &start)) {
      halved = segment_->stereo_quality()->why_halved(start.segment->halvings());
      set_segment(std::move(start.segment));
    } else if (!begun) {
      out->reason = FrameCheck::with_exposure(segment_->reason(), frame);
      return;
    }
    begin_map(frame, start.left, out);
    if (!halved.empty()) out->reason = halved;
  }

  /// A map, and the frame as that sees it.
  struct Start {
    std::unique_ptr<MapSegment> segment;
    MonoFrame left;
  };

  /// What is blurred, noisy or pale at full resolution may be clear enough in smaller images:
  /// begins a map in those with this frame, in place of `whole`.
  bool halve(const MapSegment& whole, const Halving& may, const StereoFrame& frame,
             const SideImage* right, const SE3& T_odom_left, Start* start) {
    for (int halvings = 1; halvings <= may.most; ++halvings) {
      auto segment = new_segment(whole.index(), halvings);
      const MonoFrame left = preparation_.prepare_left(frame, observer_, halvings);
      if (!segment->initialize_from_stereo(left, *right, T_odom_left)) continue;
      const StereoQuality& quality = *segment->stereo_quality();
      if (may.if_clearer && !quality.is_clearer_than(*whole.stereo_quality())) continue;
      *start = {std::move(segment), left};
      return true;
    }
    return false;
  }

  /// The segment's first pose, after `initialize`.
  void begin_map(const StereoFrame& frame, const MonoFrame& left, OdometryOutput* out) {
    if (auto start = segment_->take_start_outcome()) {
      publish_keyframes(*start);
      if (start->scale_job) finish_scale(*start->scale_job);
    }
    const auto reference = segment_->vo().reference();
    const bool from_this_frame =
        reference->stamp_ns == frame.stamp_ns && reference->keyframe_id == 0;
    if (preparation_.has_rolling_shutter() && from_this_frame) first_frame_ = frame;
    TrackedFrame first;
    first.frame = left;
    first.reference = reference;
    first.T_world_camera = reference->T_world_camera;
    recorder_.add(first);
    out->is_keyframe = true;
    out->keyframe_id = reference->keyframe_id;
    set_pose(first.T_world_camera, Mat6::Zero(), Mat6::Zero(), out);
    judge(FrameTracking(), "", out);
  }

  MonoFrame prepare_left(const StereoFrame& frame, const Vec6& rate) {
    return preparation_.prepare_left(frame, observer_, segment_->halvings(), rate);
  }

  /// `before`: the same frame as it was tracked when it was prepared for another motion, or null.
  TrackedFrame track(const MonoFrame& left, const TrackedFrame* before) {
    const ScopedStage stage(observer_, Stage::kTracking);
    return before == nullptr ? segment_->track(left) : segment_->track_again(left, *before);
  }

  /// Where a rolling shutter's image was prepared for another motion than is found, it is prepared
  /// again. (More often changes nothing to the better.)
  TrackedFrame track(const StereoFrame& frame, const MonoFrame& left) {
    TrackedFrame tracked = track(left, nullptr);
    if (!tracked.tracking.good && !left.rate.isZero(0.0)) {
      // It may have been prepared for a motion that has just ended.
      tracked = track(prepare_left(frame, Vec6::Zero()), nullptr);
    }
    if (!tracked.tracking.good) return tracked;
    const ReadoutMotion& motion = segment_->readout_motion();
    if (motion.differs(motion.found(), tracked)) {
      const TrackedFrame better = track(prepare_left(frame, motion.found()), &tracked);
      if (better.tracking.good) tracked = better;
    }
    wait_for_steadiness(left.rate, &tracked);
    return tracked;
  }

  /// What was read out while the camera was knocked has a shape that no one rate undoes: others
  /// than such frames become keyframes, for as long as that can wait.
  void wait_for_steadiness(const Vec6& expected_rate, TrackedFrame* tracked) {
    constexpr int kMostWaiting = 4;  // frames
    if (!tracked->wants_keyframe) return;
    const bool steady = segment_->readout_motion().is_steady(expected_rate);
    unsteady_ = steady ? 0 : unsteady_ + 1;
    if (!steady && unsteady_ <= kMostWaiting) tracked->wants_keyframe = false;
  }

  /// A rolling shutter's motion is not known in a map's first frame, and its points would suffer
  /// from that as long as they live: with the second frame it is, and the map begins once more.
  TrackedFrame begin_again(const StereoFrame& first, const StereoFrame& frame,
                           const TrackedFrame& tracked) {
    const Vec6 rate = segment_->readout_motion().found();
    auto segment = new_segment(segment_->index(), segment_->halvings());
    const SE3 T_odom_left = reckoning_.at(first.stamp_ns);
    if (!segment->initialize_from_stereo(prepare_left(first, rate), first.right, T_odom_left)) {
      return tracked;
    }
    segment->take_start_outcome();
    TrackedFrame again =
        segment->track_from(prepare_left(frame, rate), tracked.tracking.T_current_reference);
    if (!again.tracking.good) return tracked;
    set_segment(std::move(segment));
    return again;
  }

  void follow(const StereoFrame& frame, const SideImage* right, const std::string& right_problem,
              OdometryOutput* out) {
    const Vec6 rate = segment_->readout_motion().expected(frame.stamp_ns);
    TrackedFrame tracked = track(frame, prepare_left(frame, rate));
    if (first_frame_ && tracked.tracking.good) {
      const StereoFrame first = *std::exchange(first_frame_, std::nullopt);
      tracked = begin_again(first, frame, tracked);
    }
    std::optional<SE3> recognized;
    bool found_again = false;
    if (map_broke_down() || !tracked.tracking.good || is_doubtful(tracked, reckoning_)) {
      recognized = recognize(tracked.frame, right);
      found_again = recognized && !map_broke_down() &&
                    track_where(*recognized, reckoning_, segment_.get(), &tracked);
    }
    if (map_broke_down() || !tracked.tracking.good) {
      lose(frame, right, recognized, tracked.tracking, out);
      return;
    }
    failures_ = 0;
    ++followed_;
    recorder_.add(tracked);
    const FrameTracking& t = tracked.tracking;
    out->is_keyframe = tracked.wants_keyframe;
    out->keyframe_id = tracked.reference->keyframe_id;
    out->inliers = static_cast<std::uint32_t>(t.inliers);
    out->residual = t.rmse;
    set_pose(tracked.T_world_camera, rotated(tracked.T_world_camera.rotation(), tracked.covariance),
             carried(tracked.reference->covariance, tracked.T_world_camera.translation()), out);
    map(std::move(tracked), right);
    judge(t, right_problem, out);
    if (out->is_keyframe && preparation_.wants_light_out()) take_light_out(frame, right, out);
    if (found_again && out->reason.empty()) out->reason = "found by what the last keyframes saw";
  }

  /// The lamps move along: a map of images that are freed of their light takes over, if one can
  /// begin with this frame.
  void take_light_out(const StereoFrame& frame, const SideImage* right, OdometryOutput* out) {
    if (threads_) threads_->drain();
    preparation_.take_light_out(true);
    const bool begun = begin_next_segment(frame, right, out->T_odom_left, false);
    preparation_.take_light_out(begun);
    if (begun) out->reason = "lamps that move along light the scene; a new segment begins";
  }

  /// T_odom_left by what the last keyframes saw.
  std::optional<SE3> recognize(const MonoFrame& left, const SideImage* right) {
    if (right == nullptr || places_.empty()) return std::nullopt;
    if (threads_) threads_->drain();
    return places_.find(left, *right, segment_->halvings(), right_turn(), reckoning_);
  }

  std::string why_lost(const FrameTracking& tracking) const {
    if (map_broke_down()) return "the map broke down";
    if (!tracking.out_of_reach) return "this frame does not fit the map";
    return "this frame fits the map only where max_acceleration does not let the camera be";
  }

  void lose(const StereoFrame& frame, const SideImage* right, const std::optional<SE3>& recognized,
            const FrameTracking& tracking, OdometryOutput* out) {
    ++failures_;
    out->state = OdometryState::kLost;
    out->reason = FrameCheck::with_exposure(why_lost(tracking), frame);
    const bool over = failures_ >= config_.lost_frames || map_broke_down();
    const SE3 T_odom_left = recognized.value_or(reckoning_.at(frame.stamp_ns));
    const bool is_gone = over || is_left_behind(frame);
    constexpr int kYoung = 10;
    if (is_gone && followed_ < kYoung && segment_->is_noisy()) noise_broke_ = true;
    if (is_gone && begin_next_segment(frame, right, T_odom_left, over)) {
      out->reason += "; a new segment begins";
    }
  }

  /// Whether no later frame will fit the map any better. One frame may be bad by itself.
  bool is_left_behind(const StereoFrame& frame) const {
    constexpr double kFar = 0.25;    // mean depths
    constexpr double kTurned = 0.4;  // [rad]
    constexpr int kFewest = 2;
    if (followed_ == 0) return true;
    if (failures_ < kFewest) return false;
    const SE3 moved = reckoning_.since_last(frame.stamp_ns);
    return moved.translation().norm() * segment_->vo().reference()->mean_rho > kFar ||
           moved.rotation().log().norm() > kTurned;
  }

  /// The next segment begins with this frame, if it can; else, if the one before is `over`, with a
  /// later one.
  bool begin_next_segment(const StereoFrame& frame, const SideImage* right, const SE3& T_odom_left,
                          bool over) {
    if (threads_) threads_->drain();
    auto next = new_segment(next_segment_, 0);
    Start start{nullptr, preparation_.prepare_left(frame, observer_)};
    bool begun = next->initialize(start.left, right, T_odom_left);
    Halving may = next->halving(noise_broke_);
    // Where only smaller images did so far, they need not wait.
    const int known = segment_->halvings();
    if (!begun && known > 0 && next->stereo_quality()) may = {known, false};
    if (halve(*next, may, frame, right, T_odom_left, &start)) {
      next = std::move(start.segment);
      begun = true;
    }
    if (!begun && !over) return false;
    end_segment();
    sync_failed_ = false;
    begin_segment(begun ? std::move(next) : new_segment(next_segment_, 0));
    OdometryOutput not_published;
    not_published.stamp_ns = frame.stamp_ns;
    if (begun) begin_map(frame, start.left, &not_published);
    return true;
  }

  bool map_broke_down() const { return sync_failed_ || (threads_ && threads_->map_failed()); }

  void map(TrackedFrame tracked, const SideImage* right) {
    if (threads_) {
      MappingJob job{std::move(tracked), std::nullopt};
      if (right != nullptr && job.tracked.wants_keyframe) job.right = *right;
      if (!threads_->push(std::move(job), config_.wait_for_mapping)) ++dropped_;
      return;
    }
    MappingOutcome outcome = segment_->map(tracked, right);
    publish_keyframes(outcome);
    sync_failed_ = outcome.map.failed;
    if (outcome.scale_job) finish_scale(*outcome.scale_job);
  }

  void finish_scale(const ScaleJob& job) {
    sink_->on_scale(segment_->finish_scale(job, segment_->estimate_scale(job)));
  }

  void publish_keyframes(const MappingOutcome& outcome) {
    for (const KeyframeOutput& k : outcome.keyframes) {
      places_.note(k);
      if (k.lens) lens_.note(*k.lens);
      sink_->on_keyframe(k);
    }
    const std::lock_guard lock(map_mutex_);
    map_points_ = static_cast<std::uint32_t>(outcome.map.active_points);
    map_keyframes_ = static_cast<std::uint32_t>(outcome.map.keyframes);
    co_moving_share_ = outcome.map.co_moving_share;
  }

  void fill_counters(OdometryOutput* out) const {
    out->received = received_;
    out->rejected = rejected_;
    out->dropped_queue = dropped_;
    out->reset_counter = reset_counter_;
    out->segment = segment_->index();
    out->halvings = segment_->halvings();
    out->corner_light = preparation_.corner_light();
    out->distance_m = distance_;
    out->queue_depth = threads_ ? static_cast<std::uint32_t>(threads_->queue_depth()) : 0;
    const std::lock_guard lock(map_mutex_);
    out->points = map_points_;
    out->keyframes = map_keyframes_;
    out->co_moving_share = co_moving_share_;
  }

  /// `frame`: covariance of the frame's own alignment; `inherited`: of what it hangs on, but for
  /// the scale's part.
  void set_pose(const SE3& T_odom_left, const Mat6& frame, const Mat6& inherited,
                OdometryOutput* out) {
    out->pose_valid = true;
    out->T_odom_left = T_odom_left;
    out->frame_covariance = frame;
    out->pose_covariance = frame + inherited;
    const ScaleStatus scale = segment_->scale_status();
    out->scale_valid = scale.locked;
    out->log_scale = scale.log_scale;
    out->log_scale_sigma = scale.sigma;
    out->last_correction = scale.last_correction;
    out->scale_residual = scale.residual;
    out->scale_verdict = scale.verdict;
    out->decalibrated = scale.decalibrated;
    out->right_turn = scale.right_turn.log();
    out->focal_error = lens_.focal_error();
    if (scale.accepted_stamp_ns != 0) {
      out->scale_age_s = kNanosecond * static_cast<double>(out->stamp_ns - scale.accepted_stamp_ns);
    }
    out->pose_covariance.topLeftCorner<3, 3>() +=
        scale.position_covariance(T_odom_left.translation());
    if (!scale.locked) reckoning_.forget_motion();
    reckoning_.note(out->stamp_ns, T_odom_left, published_.has_value() && scale.locked);
    if (published_) distance_ += set_velocity(*published_, scale.sigma, out);
    published_ = PublishedPose{out->stamp_ns, T_odom_left, frame};
  }

  void judge(const FrameTracking& tracking, const std::string& right_problem, OdometryOutput* out) {
    judge_frame(config_, tracking, segment_->vo().reference()->mean_rho, right_problem, out);
  }

  StereoOdometryConfig config_;
  OutputSink* sink_;
  StageObserver* observer_;
  FramePreparation preparation_;
  FrameCheck check_;
  RecentPlaces places_;
  LensWatch lens_;
  WorkerPool pool_;

  std::unique_ptr<MapSegment> segment_;
  std::uint32_t next_segment_ = 0;
  std::optional<StereoFrame> first_frame_;  ///< Of a rolling shutter, until there is a second one.
  int unsteady_ = 0;                        ///< Frames in a row that would have been keyframes.
  TrajectoryRecorder recorder_;
  std::optional<PublishedPose> published_;
  DeadReckoning reckoning_;
  double distance_ = 0.0;
  int failures_ = 0;          ///< Frames in a row without a pose.
  int followed_ = 0;          ///< Frames of the segment with a pose, but for its first.
  bool noise_broke_ = false;  ///< A map of whole, noisy images, which did not last.
  bool sync_failed_ = false;
  std::uint64_t received_ = 0;
  std::uint64_t rejected_ = 0;
  std::uint64_t dropped_ = 0;
  std::uint32_t reset_counter_ = 0;

  mutable std::mutex map_mutex_;
  std::uint32_t map_points_ = 0;
  std::uint32_t map_keyframes_ = 0;
  double co_moving_share_ = 0.0;

  // Last: its threads use what stands above.
  std::unique_ptr<LiveThreads> threads_;
};

StereoOdometry::StereoOdometry(const StereoOdometryConfig& config, const StereoCameras& cameras,
                               OutputSink* sink, StageObserver* observer)
    : impl_(std::make_unique<Impl>(config, cameras, sink, observer)) {}

StereoOdometry::~StereoOdometry() = default;

void StereoOdometry::process(const StereoFrame& frame) { impl_->process(frame); }
void StereoOdometry::finish() { impl_->finish(); }
void StereoOdometry::reset() { impl_->reset(); }
std::vector<TrajectoryPose> StereoOdometry::refined_trajectory() const {
  return impl_->trajectory();
}
const StereoRig& StereoOdometry::tracked_rig() const { return impl_->tracked_rig(); }
const ImageU8& StereoOdometry::tracked_mask() const { return impl_->tracked_mask(); }
SO3 StereoOdometry::right_turn() const { return impl_->right_turn(); }

}  // namespace sovo
