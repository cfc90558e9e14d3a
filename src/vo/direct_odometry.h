#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sovo/vo/bundle_adjustment.h"
#include "sovo/vo/co_moving_cells.h"
#include "sovo/vo/coarse_tracker.h"
#include "sovo/vo/direct_config.h"
#include "sovo/vo/exposure_estimate.h"
#include "sovo/vo/image_change.h"
#include "sovo/vo/keyframe_policy.h"
#include "sovo/vo/light_observers.h"
#include "sovo/vo/map_history.h"
#include "sovo/vo/monocular_backend.h"
#include "sovo/vo/motion_check.h"
#include "sovo/vo/motion_model.h"
#include "sovo/vo/pixel_selector.h"
#include "sovo/vo/point_activation.h"
#include "sovo/vo/point_sights.h"
#include "sovo/vo/window.h"
#include "sovo/vo/worker_pool.h"

namespace sovo {

/// Direct sparse odometry of one camera: tracking of every frame, a sliding window of keyframes,
/// points and a marginalization prior.
class DirectOdometry final : public MonocularBackend {
 public:
  /// `camera`: pinhole without distortion. `mask`: 0 where pixels must not be used (may be empty).
  /// `light` is told what keyframes show of it.
  DirectOdometry(const DirectConfig& config, const CameraModel& camera, const ImageU8& mask,
                 int seed, WorkerPool* pool, const LightObservers& light = {});

  void use_static_residuals(const StereoRig& rig, StaticScale scale) override {
    window_.set_rig(rig, scale);
  }
  int wanted_points() const override { return config_.points.active_points; }
  std::vector<SelectedPixel> select_pixels(const MonoFrame& frame, int wanted) override;
  /// Points with a depth become active, the others immature.
  void begin(const MonoFrame& frame, const SE3& T_world_camera,
             const std::vector<StartPoint>& points, const ImagePyramidPtr& right) override;
  TrackedFrame track(const MonoFrame& frame, double max_acceleration) override;
  TrackedFrame track_again(const MonoFrame& frame, const TrackedFrame& before) override;
  TrackedFrame track_from(const MonoFrame& frame, const SE3& T_current_reference) override;
  void take_back() override { past_ = past_kept_; }
  /// Traces the immature points, and makes the frame a keyframe when it wants to be one and its
  /// reference is still the newest.
  MapResult map(const TrackedFrame& tracked, const KeyframeStereo& stereo,
                const MapTimer& timer) override;
  const std::optional<KeyframeSnapshot>& snapshot() const override { return snapshot_; }
  double apply(const ScaleCorrection& correction) override;
  std::vector<KeyframeState> window_keyframes() const override;
  const std::vector<KeyframePose>& keyframes() const override { return history_.keyframes(); }
  std::uint32_t oldest_in_window() const override { return window_[0].id; }
  ImageU8 co_moving_mask() const override;
  int num_active_points() const override { return window_.num_active_points(); }
  double log_scale() const override { return history_.log_scale(); }
  std::shared_ptr<const ReferenceKeyframe> reference() const override {
    return tracking_reference();
  }

  const Window& window() const { return window_; }
  std::shared_ptr<const TrackingReference> tracking_reference() const;

 private:
  /// What a frame is compared with.
  struct TrackingPast {
    MotionModel motion;
    Affine affine;            ///< Of the last frame.
    LastTracking tracking;    ///< Of the last frame.
    double first_rmse = 0.0;  ///< Of the first frame that was tracked against this keyframe.
    std::uint32_t first_rmse_keyframe = 0;
    bool has_first_rmse = false;
    double sharpest = 0.0;  ///< `TrackingResult::sharpness` of the sharpest frame lately.
    int rest_failed = 0;    ///< How often in a row another motion of the rest was sought in vain,
    int rest_waits = 0;     ///< and the frames until it is sought again.
    bool motion_confirmed = false;  ///< Though much stays in its place, when it was sought last.
    bool stands = false;            ///< Though much moves, or goes on slowly from there:
    ChosenCells moving;             ///< the cells in which it moved,
    std::uint32_t moving_keyframe = 0;  ///< and of which reference.
    RestDenial rest_denial;
  };

  void trace_all(const MonoFrame& frame, const SE3& T_world_camera, const Affine& affine);
  MapResult make_keyframe(const TrackedFrame& tracked, const SE3& T_world_camera,
                          const KeyframeStereo& stereo, const MapTimer& timer);
  /// Tells what the newest keyframe shows of the light, after its bundle adjustment.
  void observe_light();
  std::vector<SelectedPixel> select_lasting_pixels();
  std::vector<SelectedPixel> select_usable(const ImagePyramid& pyramid, int wanted);
  /// Takes the sparse pixels' points out of a map that has only its first keyframe.
  void drop_sparse_points();
  void find_co_moving(const TrackedFrame& tracked, const SE3& T_world_camera);
  void leave_out_co_moving();
  void begin_residuals_in_newest();
  void add_immature_points(const DepthProposer& proposer, const MapTimer& timer);
  void set_right_image(const ImagePyramidPtr& right, Keyframe* keyframe);
  std::vector<KeyframeState> marginalize(const MapTimer& timer);
  void keep_point(const Point& point, double rho_unit, KeyframePoints* points) const;
  KeyframeState state_without_active_points(const Keyframe& keyframe) const;
  /// `rmse`: of the last frame that was tracked; nothing at a map's beginning.
  void publish_reference(std::span<const SeenPoint> points, std::optional<double> rmse);
  double share_of_thresholds(const TrackingReference& reference, std::optional<double> rmse) const;
  std::vector<WindowPose> window_poses() const;
  void take_snapshot();
  TrackedFrame track_hypotheses(const MonoFrame& frame,
                                std::shared_ptr<const TrackingReference> reference);
  void find_motion_hypotheses(const TrackingReference& reference, const MonoFrame& frame,
                              double max_acceleration);
  /// The likeliest of the motions to try where none is known.
  std::vector<SE3> likely_unknown(const TrackingReference& reference, const MonoFrame& frame,
                                  const Affine& affine, const SE3& around);
  /// The tracker's best of these motions; not good when the camera cannot be there.
  TrackingResult track_from_any(const TrackingReference& reference, const MonoFrame& frame,
                                std::span<const SE3> hypotheses,
                                const std::optional<SE3>& expected);
  /// From the likely motions, and where that leads elsewhere than the motion did, from there on the
  /// finest levels alone. Of poses that fit alike it is the one that asks for less acceleration.
  TrackingResult track_likely(const TrackingReference& reference, const MonoFrame& frame,
                              const KnownMotion& known);
  /// From the likely motions, and when none fits as expected, from those of a camera that was
  /// knocked.
  TrackingResult align(const TrackingReference& reference, const MonoFrame& frame);
  /// From the likely motions; where only a world at rest would fit so, from those of the rest,
  /// which are then told to `map` in `views`.
  TrackingResult align_whole_or_rest(const TrackingReference& reference, const MonoFrame& frame,
                                     std::shared_ptr<const FrameViews>* views);
  /// `whole`, or where the image speaks against it a pose by what does not stay in its place.
  TrackingResult whole_or_rest(const TrackingReference& reference, const MonoFrame& frame,
                               TrackingResult whole, std::shared_ptr<const FrameViews>* views);
  /// Where a camera of which no motion is known may be rather than where it was found, as far as it
  /// is as turned: most of all straight on or back from the reference.
  TrackingResult search_ahead(const TrackingReference& reference, const MonoFrame& frame,
                              TrackingResult found);
  TrackingReference as_seen(const TrackingReference& reference, const ViewShift& rows,
                            const SE3& T_current_reference) const;
  /// By how much a pose moves the reference's points, RMS [px of a VGA image].
  double flow_of(const SE3& T_current_reference, const TrackingReference& reference) const;
  /// Whether a pose is that of the reference: its points move by a pixel or so.
  bool is_at_rest(const TrackingResult& tracked, const TrackingReference& reference) const;
  /// `found`, or what explains more of the image: that the camera is still at rest, or goes on
  /// slowly from there, while something rigid and strong moves before it, as the surface of water
  /// does that is seen from below. That drags a pose along.
  TrackingResult found_or_at_rest(const TrackingReference& reference, const MonoFrame& frame,
                                  TrackingResult found);
  /// Notes what moves before a camera at rest; not where what stays may be its own vehicle.
  bool note_moving(const TrackingReference& reference, const ImageF& image,
                   const BrightnessTransfer& transfer);
  /// A frame by what does not move so, from the `last` pose on.
  TrackingResult track_standing(const TrackingReference& reference, const MonoFrame& frame,
                                const Affine& affine, const SE3& last);
  /// Whether the image speaks against a pose: much of it moves before a camera at rest, or stays
  /// where it should have moved.
  bool is_doubtful(const TrackingReference& reference, const MonoFrame& frame,
                   TrackingResult* whole);
  MotionEvidence evidence_of(const TrackingReference& reference, const MonoFrame& frame,
                             const TrackingResult& tracked);
  /// A motion of a map's second frame, of which none is known, where the world contradicts that the
  /// camera stands, or hardly moves: that may be all that fits, or more than what does (`near`),
  /// where the vehicle's own body has most of the points. As above, told in `views`.
  std::optional<TrackingResult> start_beside_body(const TrackingReference& reference,
                                                  const MonoFrame& frame,
                                                  const TrackingResult& near,
                                                  std::shared_ptr<const FrameViews>* views);
  /// Squares that a motion should have taken away, and which stayed.
  ChosenCells staying_of(const TrackingReference& reference, const MonoFrame& frame,
                         const TrackingResult& tracked);
  /// Aligns anew without what stays in its place, and tells in `co_moving` what should have moved.
  /// `before` is told that its motion is confirmed where that is found again; `starts`: it tells
  /// nothing against another one.
  std::optional<TrackingResult> align_rest(const TrackingReference& reference,
                                           const MonoFrame& frame, bool starts,
                                           TrackingResult* before, ChosenCells* co_moving);
  /// The motion that fits the `rest` best, of those to try around `before` where none is known;
  /// `starts`: it is searched for ahead and all around, too.
  TrackingResult track_rest(const TrackingReference& rest, const MonoFrame& frame,
                            const TrackingResult& before, bool starts);
  /// Aligns `from` a pose on without what moves along: what stays in its place since it is far
  /// tells of the motion, too.
  std::optional<TrackingResult> track_without(const TrackingReference& reference,
                                              const MonoFrame& frame, const ChosenCells& co_moving,
                                              const SE3& from, const Affine& affine, bool starts);
  /// Where a camera may be rather than where the rest `found` it: anywhere near `standing`.
  TrackingResult search_around(const TrackingReference& rest, const MonoFrame& frame,
                               const TrackingResult& standing, TrackingResult found);
  /// Whether a pose fits by the points that agree with it: a few that are on the body after all
  /// outweigh a weak world.
  bool is_believed_beside(const TrackingReference& rest, const MonoFrame& frame,
                          const TrackingResult& tracked);
  CoarseTracker::Fit fit_of(const TrackingReference& reference, const MonoFrame& frame,
                            const TrackingResult& tracked);
  /// Compares a tracked frame with those before it, and notes what the next one is compared with.
  TrackedHistory compare_with_past(const TrackingReference& reference, const MonoFrame& frame,
                                   const TrackingResult& tracked);

  DirectConfig config_;
  CameraModel camera_;
  ImageU8 mask_;
  WorkerPool* pool_;
  int num_levels_;

  // Mapping side.
  Window window_;
  CoMovingCells co_moving_;
  MotionCheck motion_check_;
  ExposureEstimate exposure_;
  LightObservers light_;
  PointSights sights_;
  PixelSelector selector_;
  double lasting_share_ = 1.0;  ///< Of the pixels selected last, in view of the next keyframe.
  PointActivator activator_;
  BundleAdjuster adjuster_;
  std::uint32_t next_id_ = 0;
  /// Active and immature points that are not of sparse pixels, until the map's second frame.
  std::optional<std::pair<std::size_t, std::size_t>> before_sparse_;
  std::optional<KeyframeSnapshot> snapshot_;
  MapHistory history_;
  BrightnessTransfer right_brightness_;  ///< Of the newest keyframe with a right image.
  double gradient_scatter_ = 1.0;        ///< Of the last bundle adjustment.
  std::map<std::uint32_t, KeyframePoints> marginalized_;  ///< By the window's keyframes.

  // Shared: the reference.
  mutable std::mutex reference_mutex_;
  std::shared_ptr<const TrackingReference> reference_;

  // Tracking side.
  CoarseTracker tracker_;
  TrackingPast past_;
  TrackingPast past_before_;  ///< As the frame tracked last found it.
  TrackingPast past_kept_;    ///< As the last `track_from` found it.
  /// The motion since the reference when it is as it was between the past frames.
  std::optional<KnownMotion> known_motion_;
  bool place_unknown_ = false;   ///< Neither a motion nor recognition tells where the frame is.
  std::vector<SE3> hypotheses_;  ///< T_camera_reference of the new frame, the likeliest first.
};

}  // namespace sovo
