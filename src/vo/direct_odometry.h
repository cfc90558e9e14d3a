#pragma once

#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sovo/vo/bundle_adjustment.h"
#include "sovo/vo/coarse_tracker.h"
#include "sovo/vo/direct_config.h"
#include "sovo/vo/keyframe_policy.h"
#include "sovo/vo/keyframe_poses.h"
#include "sovo/vo/monocular_odometry.h"
#include "sovo/vo/pixel_selector.h"
#include "sovo/vo/point_activation.h"
#include "sovo/vo/window.h"
#include "sovo/vo/worker_pool.h"

namespace sovo {

/// A frame of the left camera, undistorted and photometrically corrected.
struct MonoFrame {
  std::int64_t stamp_ns = 0;
  double exposure_s = 0.0;  ///< 0: unknown.
  ImagePyramidPtr pyramid;
};

/// First depth of a pixel, from wherever it is known.
struct DepthProposal {
  float rho = 0.0F;    ///< [1/m]
  float sigma = 0.0F;  ///< Standard deviation of rho; 0: there is no proposal.
};

/// Proposes depths for pixels of a frame; `proposals` has the size of `pixels`.
using DepthProposer = std::function<void(const std::vector<SelectedPixel>& pixels,
                                         std::vector<DepthProposal>* proposals)>;

/// What the right camera tells of a new keyframe.
struct KeyframeStereo {
  DepthProposer depths;   ///< Of its new pixels; empty: they begin without.
  ImagePyramidPtr right;  ///< Its raw right image, for static residuals; null: it gets none.
};

/// A point that a map begins with.
struct StartPoint {
  SelectedPixel pixel;
  DepthProposal depth;
};

/// A frame after tracking, as mapping takes it.
struct TrackedFrame {
  MonoFrame frame;
  TrackingResult tracking;
  std::shared_ptr<const TrackingReference> reference;
  SE3 T_world_camera;  ///< With the reference as it was while tracking.
  bool wants_keyframe = false;
};

/// A keyframe with points of its own: those that were marginalized, and those still active.
struct KeyframeState {
  std::uint32_t id = 0;
  std::int64_t stamp_ns = 0;
  ImagePyramidPtr pyramid;
  /// Where they are known to better than half their depth. Inverse depths are in the unit that the
  /// map began with: exp(-log_scale) times them are in the unit of a `log_scale`.
  KeyframePoints points;
};

/// What one call of `map` did.
struct MapResult {
  bool is_keyframe = false;
  bool failed = false;  ///< The window broke down; begin anew.
  BundleResult bundle;
  int active_points = 0;
  int keyframes = 0;
  std::vector<KeyframeState> left;  ///< Keyframes that left the window, oldest first.
};

/// Parts of the mapping that are timed.
enum class MapStage { kTracing, kSelection, kStaticMatching, kBundleAdjustment, kMarginalization };
using MapTimer = std::function<void(MapStage, double seconds)>;

/// Where the camera was in the last frame, and where the new one should find it
/// (T_camera_reference).
struct KnownMotion {
  SE3 expected;
  SE3 last;
  double steps = 1.0;  ///< Time since then over that between the two frames before.
  /// How far from there it may be, at the greatest acceleration and with what stamps and poses err
  /// by [the map's unit of length]; infinite: not known.
  double reach = std::numeric_limits<double>::infinity();
};

/// Direct sparse odometry of one camera: tracking of every frame, a sliding window of keyframes,
/// points and a marginalization prior. Its lengths are in whatever unit the map began with;
/// `apply` rescales it.
///
/// `track` may run on one thread while `map`, `apply` and `snapshot` run on another.
class DirectOdometry {
 public:
  /// `camera`: pinhole without distortion. `mask`: 0 where pixels must not be used (may be empty).
  DirectOdometry(const DirectConfig& config, const CameraModel& camera, const ImageU8& mask,
                 int seed, WorkerPool* pool);

  /// From now on keyframes with a right image get static residuals, which hold the scale.
  /// `rig.left` is the camera that is tracked.
  void use_static_residuals(const StereoRig& rig) { window_.set_rig(rig); }

  /// Chooses the pixels that a map would begin with.
  std::vector<SelectedPixel> select_pixels(const MonoFrame& frame, int wanted);

  /// Begins a map with `frame` as first keyframe: points with a depth become active, the others
  /// immature. What another beginning left is forgotten.
  void begin(const MonoFrame& frame, const SE3& T_world_camera,
             const std::vector<StartPoint>& points, const ImagePyramidPtr& right = nullptr);

  /// Tracks a frame against the newest reference. `tracking.good` is false when it is lost, also
  /// when only a pose fits that takes more than `max_acceleration` since the frames before [the
  /// map's unit of length / s^2]; 0: no such limit is known.
  TrackedFrame track(const MonoFrame& frame, double max_acceleration = 0.0);

  /// The same from a known motion since the newest keyframe.
  TrackedFrame track_from(const MonoFrame& frame, const SE3& T_current_reference);

  /// Takes a tracked frame into the map: traces the immature points, or makes it a keyframe.
  MapResult map(const TrackedFrame& tracked, const KeyframeStereo& stereo, const MapTimer& timer);

  /// The newest keyframe after its bundle adjustment; nothing before the second keyframe.
  const std::optional<KeyframeSnapshot>& snapshot() const { return snapshot_; }

  /// Applies a measured similarity, less what was applied since its snapshot. Returns the
  /// log-scale that was applied.
  double apply(const ScaleCorrection& correction);

  const Window& window() const { return window_; }
  /// The keyframes of the window with their points as they are now, oldest first.
  std::vector<KeyframeState> window_keyframes() const;
  std::uint64_t scale_epoch() const { return scale_epoch_; }
  double log_scale() const { return log_scale_; }

  /// Poses of all keyframes of the map, by id.
  const std::vector<KeyframePose>& keyframes() const { return keyframes_.poses(); }

  std::shared_ptr<const TrackingReference> reference() const;

 private:
  void trace_all(const MonoFrame& frame, const SE3& T_world_camera, const Affine& affine);
  MapResult make_keyframe(const TrackedFrame& tracked, const SE3& T_world_camera,
                          const KeyframeStereo& stereo, const MapTimer& timer);
  std::vector<SelectedPixel> select_lasting_pixels();
  void add_immature_points(const DepthProposer& proposer, const MapTimer& timer);
  void set_right_image(const ImagePyramidPtr& right, Keyframe* keyframe);
  std::vector<KeyframeState> marginalize(const MapTimer& timer);
  void keep_point(const Point& point, double rho_unit, KeyframePoints* points) const;
  KeyframeState state_without_active_points(const Keyframe& keyframe) const;
  void extend_covariance(const Mat6& newest_covariance);
  void rescale_covariance(double scale, const Vec3& centre);
  void publish_reference();
  std::vector<WindowPose> window_poses() const;
  void take_snapshot();
  TrackedFrame track_hypotheses(const MonoFrame& frame,
                                std::shared_ptr<const TrackingReference> reference);
  void find_motion_hypotheses(const TrackingReference& reference, const MonoFrame& frame,
                              double max_acceleration);
  /// The tracker's best of these motions; not good when the camera cannot be there.
  TrackingResult track_from_any(const TrackingReference& reference, const MonoFrame& frame,
                                std::span<const SE3> hypotheses);
  /// From the likely motions, and when none fits as expected, from those of a camera that was
  /// knocked.
  TrackingResult align(const TrackingReference& reference, const MonoFrame& frame);
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
  PixelSelector selector_;
  double lasting_share_ = 1.0;  ///< Of the pixels selected last, in view of the next keyframe.
  PointActivator activator_;
  BundleAdjuster adjuster_;
  std::uint32_t next_id_ = 0;
  std::uint64_t scale_epoch_ = 0;
  double log_scale_ = 0.0;
  std::vector<double> epoch_log_scale_;  ///< log_scale_ at each epoch.
  std::optional<KeyframeSnapshot> snapshot_;
  KeyframePoses keyframes_;
  /// Of the newest keyframe's pose since the map began, as in `TrackingReference`.
  Mat6 covariance_ = Mat6::Zero();
  BrightnessTransfer right_brightness_;  ///< Of the newest keyframe with a right image.
  double gradient_scatter_ = 1.0;        ///< Of the last bundle adjustment.
  std::map<std::uint32_t, KeyframePoints> marginalized_;  ///< By the window's keyframes.

  // Shared: the reference.
  mutable std::mutex reference_mutex_;
  std::shared_ptr<const TrackingReference> reference_;

  // Tracking side.
  CoarseTracker tracker_;
  struct PastFrame {
    SE3 T_camera_keyframe;
    double log_scale = 0.0;
    std::uint32_t keyframe_id = 0;
    std::int64_t stamp_ns = 0;
  };
  std::vector<PastFrame> past_;  ///< The last two frames, newest last.
  /// The motion since the reference when it is as it was between the past frames.
  std::optional<KnownMotion> known_motion_;
  std::vector<SE3> hypotheses_;  ///< T_camera_reference of the new frame, the likeliest first.
  double expected_steps_ = 1.0;  ///< Time to the new frame over that between the past two.
  Affine last_affine_;
  LastTracking last_tracking_;
  double first_rmse_ = 0.0;
  std::uint32_t first_rmse_keyframe_ = 0;
  bool has_first_rmse_ = false;
  double sharpest_ = 0.0;  ///< `TrackingResult::sharpness` of the sharpest frame lately.
};

}  // namespace sovo
