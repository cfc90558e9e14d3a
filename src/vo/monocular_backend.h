#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "sovo/geometry/stereo_rig.h"
#include "sovo/geometry/view_shift.h"
#include "sovo/image/pyramid.h"
#include "sovo/image/vignette.h"
#include "sovo/vo/brightness.h"
#include "sovo/vo/bundle_result.h"
#include "sovo/vo/keyframe_poses.h"
#include "sovo/vo/monocular_odometry.h"
#include "sovo/vo/pixel_selector.h"
#include "sovo/vo/static_scale.h"

namespace sovo {

/// A frame of the left camera, undistorted and photometrically corrected.
struct MonoFrame {
  std::int64_t stamp_ns = 0;
  double exposure_s = 0.0;  ///< 0: unknown.
  ImagePyramidPtr pyramid;
  RadialVignette vignette;  ///< That it is freed of.
  /// Of a rolling shutter: how the camera moved while the image was read out, log(T_later_earlier)
  /// a second (translation, rotation), as its images were prepared with. What it turned is undone.
  Vec6 rate = Vec6::Zero();
  ViewShift shift;  ///< Where points come to lie by the way that is left, and by a port.
  /// How the camera moves at its instant, as log(T_later_earlier) a second (translation, rotation);
  /// nothing: not known.
  std::optional<Vec6> velocity;
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
  /// The left camera at the keyframe's instant into where it was when `right` was exposed.
  SE3 T_later_left;
};

/// A point that a map begins with.
struct StartPoint {
  SelectedPixel pixel;
  DepthProposal depth;
};

/// The newest keyframe as frames are tracked against it; what a backend compares them with is in a
/// struct of its own that has this as base. Immutable once built; shared between threads.
struct ReferenceKeyframe {
  std::uint32_t keyframe_id = 0;
  std::int64_t stamp_ns = 0;
  double log_scale = 0.0;  ///< Sum of the similarities applied before it was built.
  SE3 T_world_camera;      ///< Of the keyframe when it was built.
  /// Of that pose, since the map began: (translation, rotation) in world axes, carried to the
  /// origin (geometry/pose_covariance.h). Without what errors of scale add.
  Mat6 covariance = Mat6::Zero();
  double mean_rho = 1.0;                   ///< Mean inverse depth of its points [1/m].
  std::vector<WindowPose> keyframe_poses;  ///< Of the window: earlier frames hang on them.
};

/// Multiplies all lengths by `scale`, the newest keyframe's centre fixed.
void rescale(double scale, ReferenceKeyframe* reference);

/// How a frame was tracked.
struct FrameTracking {
  bool good = false;
  bool out_of_reach = false;  ///< Not good only since the camera cannot have come there.
  SE3 T_current_reference;
  double rmse = 0.0;          ///< Residual [grey levels, or px where features are followed].
  double inlier_ratio = 0.0;  ///< Share of what is compared in view that agrees.
  int inliers = 0;
  bool rest_denied = false;  ///< Fits a camera at rest, while much of the image moves.
  /// Much agrees better where it was than where this motion takes it, and no other explains it.
  bool motion_denied = false;
};

/// What a backend keeps of a frame that was tracked until it is mapped.
struct FrameViews {
  FrameViews() = default;
  FrameViews(const FrameViews&) = delete;
  FrameViews& operator=(const FrameViews&) = delete;
  virtual ~FrameViews() = default;
};

/// A frame after tracking, as mapping takes it.
struct TrackedFrame {
  MonoFrame frame;
  FrameTracking tracking;
  Affine affine;
  /// Of T_current_reference by its alignment: (translation, rotation), left perturbation.
  Mat6 covariance = Mat6::Zero();
  std::shared_ptr<const ReferenceKeyframe> reference;
  SE3 T_world_camera;  ///< With the reference as it was while tracking.
  bool wants_keyframe = false;
  std::shared_ptr<const FrameViews> views;  ///< Null where the backend keeps none.
};

/// A point whose log-depth is known worse than this says nothing about scale.
inline constexpr double kMaxRelativeSigma = 0.5;

/// A keyframe with points of its own: those that left the window, and those still active.
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
  double co_moving_share = 0.0;     ///< Of the image: seen to move along with the camera.
  std::vector<KeyframeState> left;  ///< Keyframes that left the window, oldest first.
};

/// Parts of the mapping that are timed.
enum class MapStage { kTracing, kSelection, kStaticMatching, kBundleAdjustment, kMarginalization };
using MapTimer = std::function<void(MapStage, double seconds)>;

/// A monocular odometry as `StereoOdometry` runs it: it tracks every frame against its newest
/// keyframe, keeps a window of keyframes and points, hands out a snapshot of the newest one, from
/// which scale optimization measures, and takes back a similarity. Its lengths are in whatever
/// unit the map began with; `apply` rescales it.
///
/// `track` may run on one thread while `map`, `apply` and the rest run on another.
class MonocularBackend {
 public:
  MonocularBackend() = default;
  MonocularBackend(const MonocularBackend&) = delete;
  MonocularBackend& operator=(const MonocularBackend&) = delete;
  virtual ~MonocularBackend() = default;

  /// From now on keyframes with a right image get static residuals, which hold the scale or leave
  /// it free. `rig.left` is the camera that is tracked. Throws std::logic_error where a backend has
  /// none.
  virtual void use_static_residuals(const StereoRig& rig, StaticScale scale) = 0;

  /// Points that a map should have.
  virtual int wanted_points() const = 0;

  /// Chooses the pixels that a map would begin with; those that are `sparse` are the last ones, and
  /// more than were wanted.
  virtual std::vector<SelectedPixel> select_pixels(const MonoFrame& frame, int wanted) = 0;

  /// Begins a map with `frame` as first keyframe. Points without a depth get theirs from later
  /// frames. What another beginning left is forgotten.
  virtual void begin(const MonoFrame& frame, const SE3& T_world_camera,
                     const std::vector<StartPoint>& points, const ImagePyramidPtr& right) = 0;

  /// Tracks a frame against the newest reference. `tracking.good` is false when it is lost, also
  /// when only a pose fits that takes more than `max_acceleration` since the frames before [the
  /// map's unit of length / s^2]; 0: no such limit is known.
  virtual TrackedFrame track(const MonoFrame& frame, double max_acceleration) = 0;

  /// Tracks the frame that was tracked last once more, as it was prepared anew; what was noted of
  /// it before is replaced.
  virtual TrackedFrame track_again(const MonoFrame& frame, const TrackedFrame& before) = 0;

  /// Tracks a frame, which may be the one that was tracked last, from a known motion since the
  /// newest keyframe.
  virtual TrackedFrame track_from(const MonoFrame& frame, const SE3& T_current_reference) = 0;

  /// Forgets what the last `track_from` found: what is kept is the frame as it was tracked before.
  virtual void take_back() = 0;

  /// Takes a tracked frame into the map, as keyframe when it wants to be one.
  virtual MapResult map(const TrackedFrame& tracked, const KeyframeStereo& stereo,
                        const MapTimer& timer) = 0;

  /// The newest keyframe after its bundle adjustment; nothing before the second keyframe.
  virtual const std::optional<KeyframeSnapshot>& snapshot() const = 0;

  /// Applies a measured similarity, less what was applied since its snapshot. Returns the
  /// log-scale that was applied.
  virtual double apply(const ScaleCorrection& correction) = 0;

  /// The keyframes of the window with their points as they are now, oldest first.
  virtual std::vector<KeyframeState> window_keyframes() const = 0;

  /// Poses of all keyframes of the map, by id; those of the window as they are now.
  virtual const std::vector<KeyframePose>& keyframes() const = 0;

  /// Id of the window's oldest keyframe.
  virtual std::uint32_t oldest_in_window() const = 0;

  /// 0 where things are seen that move along with the camera, of the size of the tracked image;
  /// empty when there are none.
  virtual ImageU8 co_moving_mask() const { return {}; }

  virtual int num_active_points() const = 0;
  virtual double log_scale() const = 0;  ///< Sum of the similarities applied.
  virtual std::shared_ptr<const ReferenceKeyframe> reference() const = 0;
};

}  // namespace sovo
