#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "sovo/image/pyramid_pool.h"
#include "sovo/odometry/exposure_motion.h"
#include "sovo/odometry/frame_preparation.h"
#include "sovo/odometry/held_scale.h"
#include "sovo/odometry/odometry_output.h"
#include "sovo/odometry/readout_motion.h"
#include "sovo/odometry/right_camera.h"
#include "sovo/odometry/scale_path.h"
#include "sovo/odometry/stereo_odometry.h"
#include "sovo/odometry/stereo_start.h"
#include "sovo/vo/monocular_backend.h"
#include "sovo/vo/two_view_initializer.h"
#include "sovo/vo/worker_pool.h"

namespace sovo {

/// What tracking publishes about the scale.
struct ScaleStatus {
  bool locked = false;
  double log_scale = 0.0;
  double sigma = 0.0;
  double last_correction = 0.0;
  double residual = 0.0;
  std::int64_t accepted_stamp_ns = 0;
  ScaleVerdict verdict = ScaleVerdict::kTooFewPoints;
  bool decalibrated = false;  ///< The right camera is turned against its calibration.
  SO3 right_turn;             ///< By this, which is undone.
  ScalePath path;             ///< Up to the place of the newest keyframe whose scale was sought.

  /// What errors of scale add to the covariance of a camera's `position` [m^2].
  Mat3 position_covariance(const Vec3& position) const { return path.at(position, sigma); }
};

/// A keyframe's snapshot with the right image that was taken with it.
struct ScaleJob {
  KeyframeSnapshot snapshot;
  ImagePyramidPtr right;
  SE3 T_later_left;              ///< The left camera into where it was when `right` was exposed.
  SO3 turn;                      ///< Of the right camera, as it is undone here.
  double pyramid_seconds = 0.0;  ///< What the right pyramid cost.
  bool cold_start = false;
  /// The left image, and that of the keyframe before: the depths of the map may be wrong.
  bool fits_badly = false;

  /// `T_later_left` with the turn in it, where lengths are metres: as if the left camera had
  /// turned.
  SE3 T_later_left_turned(const SE3& T_right_left) const {
    return T_right_left.inverse() * SE3(turn, Vec3::Zero()) * T_right_left * T_later_left;
  }
};

/// What mapping a frame brought.
struct MappingOutcome {
  MapResult map;
  std::vector<KeyframeOutput> keyframes;  ///< To be given out, in this order: new, then revised.
  std::optional<ScaleJob> scale_job;
};

/// How often images may be halved for a map to begin.
struct Halving {
  int most = 0;
  bool if_clearer = false;  ///< Only where stereo depth is that much better there.
};

/// One map from its beginning to its loss: the direct odometry of the left camera, its
/// initialization, and the scale filter.
///
/// It sees images that are halved `halvings` times (FramePreparation); the keyframes that it hands
/// out have their points in the whole image all the same.
///
/// `initialize` and `track` belong to the tracking thread, `map` and `finish_scale` to the mapping
/// thread; `estimate_scale` may run anywhere.
class MapSegment {
 public:
  /// `right_turn`: what is known of it so far.
  MapSegment(const StereoOdometryConfig& config, const FramePreparation& preparation,
             std::uint32_t index, int halvings, const RightTurn& right_turn, WorkerPool* pool,
             StageObserver* observer);

  std::uint32_t index() const { return index_; }
  int halvings() const { return halvings_; }
  bool initialized() const { return initialized_; }

  /// Tries to begin the map with this frame, which is taken to be at `T_odom_left`; `right` may be
  /// null. Returns true when the map has begun, with this frame or with one that was given before.
  /// `reason()` tells what is missing.
  bool initialize(const MonoFrame& frame, const SideImage* right, const SE3& T_odom_left);
  const std::string& reason() const { return reason_; }
  /// How stereo depth looked in the last frame; none: it was not sought.
  const std::optional<StereoQuality>& stereo_quality() const { return stereo_quality_; }
  /// Whether that was of whole images whose noise decides about it.
  bool is_noisy() const;
  /// What smaller images another map may begin in with the last frame, in place of this one: where
  /// stereo depth was sought in vain for some time, or where noise decides about it, and that keeps
  /// the map from beginning, or broke one at once before (`noise_broke`).
  Halving halving(bool noise_broke) const;
  /// Tries to begin the map with the stereo depth of this frame alone.
  bool initialize_from_stereo(const MonoFrame& frame, const SideImage& right,
                              const SE3& T_odom_left);

  /// Tracks a frame. The limit of acceleration counts once the map has metres.
  TrackedFrame track(const MonoFrame& frame);
  /// Tracks a frame, which may be the one that was tracked last, from a known motion since the
  /// newest keyframe.
  TrackedFrame track_from(const MonoFrame& frame, const SE3& T_current_reference);
  /// Forgets that, for the frame as it was tracked before.
  void take_back(const TrackedFrame& before) {
    vo_->take_back();
    readout_motion_.note(before);
  }
  /// Tracks the frame that was tracked last again, prepared with another rate.
  TrackedFrame track_again(const MonoFrame& frame, const TrackedFrame& before);

  const ReadoutMotion& readout_motion() const { return readout_motion_; }

  /// Maps a tracked frame. `right` may be null (missing): then there is no scale job.
  MappingOutcome map(const TrackedFrame& tracked, const SideImage* right);

  /// The scale of a job; a pure function.
  ScaleEstimate estimate_scale(const ScaleJob& job) const;

  /// Filters the estimate and applies the correction to the window.
  ScaleRecord finish_scale(const ScaleJob& job, const ScaleEstimate& estimate);

  /// Keyframes that are not yet given out as final, as they are now: those of the window,
  /// and those that wait for a scale. While neither `map` nor `finish_scale` runs.
  std::vector<KeyframeOutput> remaining_keyframes() const;

  ScaleStatus scale_status() const;
  RightTurn right_turn() const { return right_.known(); }
  const MonocularBackend& vo() const { return *vo_; }
  /// What the beginning has mapped by itself: the first keyframe, of two views also the second.
  /// It waits here once.
  std::optional<MappingOutcome> take_start_outcome();

 private:
  TrackedFrame noted(TrackedFrame tracked);
  /// The right image of a frame that becomes a keyframe.
  ImagePyramidPtr prepare_right(const SideImage& right, const MonoFrame& frame);
  bool initialize_from_two_views(const MonoFrame& frame, const SideImage* right,
                                 const SE3& T_odom_left);
  bool finish_two_views(const MonoFrame& frame, const SideImage* right);
  std::vector<StaticMatch> match_all(const StaticMatcher& matcher, const ImagePyramid& left,
                                     const ImagePyramid& right,
                                     const std::vector<SelectedPixel>& pixels) const;
  DepthProposer stereo_proposer(const ImagePyramidPtr& left, const ImagePyramid& right,
                                const SE3& T_later_left) const;
  const StereoRig& rig() const { return preparation_.rig(halvings_); }
  bool metric() const { return filter_.locked() && config_.mode != OdometryMode::kMono; }
  /// Whether new pixels get their depths from the right image.
  bool matches_new_pixels() const;
  /// Whether the next keyframe gets static residuals. They hold the scale in mode `stereo`, and in
  /// mode `scale` while scale optimization sees too few points; else that is left to it, where both
  /// cameras expose at once: what a map with a wrong scale knows of the way between is wrong, too.
  std::optional<StaticScale> static_residuals(const SideImage& right) const;
  /// Whether static residuals own the scale, not similarities.
  bool stereo() const { return config_.mode == OdometryMode::kStereo; }
  KeyframeOutput first_keyframe(const MonoFrame& frame, const ImagePyramidPtr& right) const;
  KeyframeOutput new_keyframe(const ScaleJob& job) const;
  KeyframeOutput own_points(const KeyframeState& state) const;
  void revise(const SE3& T_odom_left, KeyframeOutput* keyframe) const;
  void revise_left(const std::vector<KeyframeState>& left, std::vector<KeyframeOutput>* out);
  /// `accepted_ns`: of what was accepted, or is held.
  void publish_scale(const ScaleRecord* record, std::optional<std::int64_t> accepted_ns);

  const StereoOdometryConfig& config_;
  const FramePreparation& preparation_;
  std::uint32_t index_;
  SE3 T_odom_left_start_;  ///< Where the first keyframe is.
  int halvings_;
  WorkerPool* pool_;
  StageObserver* observer_;

  std::unique_ptr<MonocularBackend> vo_;
  PyramidPool right_pyramids_;
  RightCamera right_;
  ExposureMotion exposure_motion_;  ///< Of the mapping thread.
  ReadoutMotion readout_motion_;    ///< Of the tracking thread.
  ScaleOptimizer optimizer_;
  ScaleFilter filter_;
  StereoAssist assist_;

  HeldScale held_scale_;  ///< After the last bundle adjustment.
  bool initialized_ = false;
  bool broken_ = false;
  std::uint32_t attempts_ = 0;                   ///< Frames given to `initialize`.
  std::optional<StereoQuality> stereo_quality_;  ///< In the last of them.
  std::string reason_;
  std::unique_ptr<TwoViewInitializer> two_view_initializer_;
  std::unique_ptr<PixelSelector> two_view_selector_;
  std::optional<MonoFrame> two_view_first_;
  std::optional<MappingOutcome> start_outcome_;

  std::vector<KeyframeOutput> waiting_;  ///< Have left the window, and wait for a scale.
  std::vector<SE3> refined_;             ///< Refined poses of all keyframes.
  std::size_t refined_until_ = 0;        ///< Those before this one do not change any more.

  bool fits_badly_ = false;  ///< The last keyframe's left image did.
  std::optional<Vec3> last_keyframe_position_;
  ScalePath scale_path_;
  mutable std::mutex status_mutex_;
  ScaleStatus status_;
};

}  // namespace sovo
