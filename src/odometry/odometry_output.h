#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sovo/geometry/se3.h"
#include "sovo/image/image.h"
#include "sovo/image/pyramid.h"
#include "sovo/image/stereo_frame.h"
#include "sovo/scale/scale_optimizer.h"
#include "sovo/vo/lens_fit.h"

namespace sovo {

/// What the odometry is doing; the values are those of VoStatus.state.
enum class OdometryState : std::uint8_t {
  kInitializing = 0,     ///< No map yet.
  kTracking = 1,         ///< Pose and scale are good.
  kScaleUnobserved = 2,  ///< Pose is tracked, the scale is not (or not yet) measured.
  kDegraded = 3,         ///< Tracked, but badly (few points, high residual, one image missing).
  kLost = 4,             ///< This frame has no pose.
  kResetting = 5,
  kStopped = 6,
};

std::string to_string(OdometryState state);

/// The stages that are timed. `kFrame` is everything but decoding, once a frame.
enum class Stage : std::uint8_t {
  kFrame = 0,
  kUndistortion,
  kPyramid,
  kTracking,
  kTracing,
  kSelection,
  kStaticMatching,
  kBundleAdjustment,
  kMarginalization,
  kScaleOptimization,
  kCount,
};

/// Name as `--profile` writes it: "frame", "undistortion", ...
std::string to_string(Stage stage);

/// Everything known about one frame at the time it is published.
struct OdometryOutput {
  std::int64_t stamp_ns = 0;
  std::uint64_t session = 0;
  std::uint64_t sequence = 0;
  OdometryState state = OdometryState::kInitializing;
  std::string reason;  ///< For people; empty when all is well.

  bool pose_valid = false;  ///< False: T_odom_left and what follows from it mean nothing.
  SE3 T_odom_left;          ///< Left optical camera into the odometry's world; first pose identity.
  /// Of (translation, rotation about fixed axes) in odom axes [m, rad], since the segment began: it
  /// grows with the way, by what keyframes, scale and this frame's alignment leave open.
  Mat6 pose_covariance = Mat6::Zero();
  /// The part of it that is this frame's alone, which no later frame inherits.
  Mat6 frame_covariance = Mat6::Zero();
  Vec6 velocity =
      Vec6::Zero();  ///< Of the left camera in its own axes (linear, angular) [m/s, rad/s].
  Mat6 velocity_covariance = Mat6::Zero();

  std::uint32_t segment = 0;      ///< Rises by one at each loss of track.
  std::uint32_t keyframe_id = 0;  ///< Reference keyframe of the pose.
  bool is_keyframe = false;

  bool scale_valid = false;      ///< Lengths are metric.
  double log_scale = 0.0;        ///< Sum of corrections since the segment began.
  double log_scale_sigma = 0.0;  ///< Posterior standard deviation.
  double last_correction = 0.0;  ///< Newest measured log-scale error.
  double scale_residual = 0.0;   ///< Photometric, of the newest optimization [grey levels].
  double scale_age_s = 0.0;      ///< Since it was accepted, or held, last.
  ScaleVerdict scale_verdict = ScaleVerdict::kTooFewPoints;

  std::uint64_t received = 0;       ///< Frames given to the odometry.
  std::uint64_t dropped_queue = 0;  ///< Frames dropped because mapping or tracking was late.
  std::uint64_t rejected = 0;       ///< Frames refused (bad stamp, size, content).
  std::uint32_t reset_counter = 0;
  int halvings = 0;  ///< How often images are halved to be tracked.
  /// The share of its light that the lens lets through in the farthest corner of the tracked image,
  /// as it was found out while flying; 1 where the calibration has a vignette.
  double corner_light = 1.0;
  bool decalibrated = false;       ///< The right camera is turned against its calibration.
  Vec3 right_turn = Vec3::Zero();  ///< And by this, about its own axes, which is undone [rad].
  /// LensWatch::focal_error: the focal length is not as it was calibrated.
  double focal_error = 0.0;
  double co_moving_share = 0.0;  ///< Of the image: moves along with the camera, and is left out.
  std::uint32_t points = 0;      ///< Active in the window.
  std::uint32_t inliers = 0;     ///< Pixels of the tracking reference that agree.
  std::uint32_t keyframes = 0;   ///< In the window.
  std::uint32_t queue_depth = 0;
  double sync_error_s = 0.0;
  double residual = 0.0;  ///< RMS of tracking [grey levels; px where features are followed].
  double distance_m = 0.0;
};

/// What is known of a frame before anything is done with it.
OdometryOutput output_for(const StereoFrame& frame);

/// A keyframe, given out twice or more. What comes later replaces what came before, as a whole.
///
/// First when bundle adjustment has taken it in: its pose is in line with the published frames, and
/// its points are those of older keyframes where it sees them (the first keyframe of a segment
/// shows its own). Then revised, at the latest when it leaves the window, or when its segment or
/// the run ends: its pose is that of the refined trajectory, and its points are its own, those that
/// were marginalized and those that are still active, in the same scale as the pose. So the revised
/// keyframes of a segment hold each point once; they depart from the published frames by the
/// corrections of scale that have been undone in them.
///
/// While the scale is sought, keyframes that have left the window wait for it, and are revised when
/// it is found or the segment ends. A map that broke down does not revise what its window holds.
struct KeyframeOutput {
  std::uint32_t id = 0;  ///< From 0 in each segment; those that are not revised ascend.
  std::uint32_t segment = 0;
  std::int64_t stamp_ns = 0;
  bool revised = false;      ///< It was given out before.
  bool scale_valid = false;  ///< Lengths are metric.
  SE3 T_odom_left;
  double log_scale = 0.0;                   ///< Sum of corrections that pose and depths have seen.
  std::vector<float> u, v;                  ///< Its points, in its undistorted image [px].
  std::vector<float> inverse_depth, sigma;  ///< 1 / z in its camera frame [1/m].
  std::vector<std::uint8_t> intensity;      ///< Grey levels of the image there.

  // Of new keyframes only:
  Mat6 covariance = Mat6::Zero();  ///< Of T_odom_left, as in OdometryOutput.
  ImagePyramidPtr left;            ///< Its undistorted image.
  ImagePyramidPtr right;           ///< The raw one that was taken with it; null: there was none.
  /// `left`'s camera into where it was when `right` was exposed, by the rig as it was calibrated: a
  /// turn of the right camera that is undone is in it.
  SE3 T_later_left;
  int halvings = 0;  ///< How often both were halved, unlike `u` and `v`.
  /// Of the size of `left`: 0 where what is seen moves along with the camera; null: nothing does.
  std::shared_ptr<const ImageU8> co_moving_mask;
  std::optional<LensEvidence> lens;  ///< Of one of `vo.window.lens_every`, where it turned.
};

/// One run of the scale optimizer, a line of `--keyframes`.
struct ScaleRecord {
  std::int64_t stamp_ns = 0;
  std::uint32_t keyframe_id = 0;
  double correction = 0.0;  ///< Applied log-scale.
  double measured = 0.0;    ///< Measured log-scale error.
  double sigma = 0.0;       ///< Of the measurement.
  ScaleVerdict verdict = ScaleVerdict::kTooFewPoints;
  double residual = 0.0;
};

/// Receives what the odometry finds. Calls come from the odometry's threads, one at a time for
/// each method; an implementation must not block for long.
class OutputSink {
 public:
  virtual ~OutputSink() = default;
  virtual void on_frame(const OdometryOutput& output) = 0;
  virtual void on_keyframe(const KeyframeOutput& keyframe) = 0;
  virtual void on_scale(const ScaleRecord& record) = 0;
};

/// Receives the time of each stage of the work; called from several threads.
class StageObserver {
 public:
  virtual ~StageObserver() = default;
  virtual void on_stage(Stage stage, double seconds) = 0;
  /// Sizes of one bundle adjustment.
  virtual void on_window(std::uint32_t points, std::uint32_t residuals) = 0;
};

/// A pose of a trajectory file.
struct TrajectoryPose {
  std::int64_t stamp_ns = 0;
  SE3 T_odom_left;
};

}  // namespace sovo
