#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "sovo/image/local_contrast.h"
#include "sovo/image/photometric.h"
#include "sovo/image/static_matcher.h"
#include "sovo/image/stereo_frame.h"
#include "sovo/image/undistorter.h"
#include "sovo/odometry/odometry_output.h"
#include "sovo/odometry/recognition_config.h"
#include "sovo/odometry/stereo_assist.h"
#include "sovo/scale/right_turn.h"
#include "sovo/scale/scale_filter.h"
#include "sovo/scale/scale_optimizer.h"
#include "sovo/vo/direct_config.h"
#include "sovo/vo/features/feature_config.h"
#include "sovo/vo/moving_light.h"

namespace sovo {

/// Who owns the metric scale.
enum class OdometryMode {
  kMono,    ///< Static matches at the first keyframe only.
  kScale,   ///< Temporal residuals in the window, scale optimization beside it (SO-DSO).
  kStereo,  ///< Static residuals in the window own the scale (as Stereo DSO).
};

/// Which monocular odometry follows the left camera.
enum class Backend {
  kDirect,    ///< By the brightness of many pixels (DirectOdometry).
  kFeatures,  ///< By corners (FeatureOdometry); not in mode `stereo`.
};

/// How the map begins.
enum class InitMethod {
  kAuto,     ///< From stereo depth when enough matches are good, else from two views.
  kStereo,   ///< From stereo depth at the first frame.
  kTwoView,  ///< From two views of the left camera; the scale is found by scale optimization.
};

/// Where a new point's first depth interval comes from.
enum class DepthInit {
  kTemporal,  ///< From epipolar search in following left images (the paper).
  kStereo,    ///< From a static match; never a prior or a residual.
  kAuto,      ///< Temporal, and stereo while that fails (StereoAssist).
};

/// What lights the scene.
enum class Lighting {
  kAuto,     ///< The world, until lamps are found to move along (MovingLight).
  kWorld,    ///< Lamps that stand still, or the sun.
  kVehicle,  ///< Lamps that move with the cameras: LocalContrast takes their light out.
};

/// Names of enum values in configuration files, found by argument-dependent lookup.
constexpr std::array<std::pair<OdometryMode, const char*>, 3> enum_names(OdometryMode) {
  return {{{OdometryMode::kMono, "mono"},
           {OdometryMode::kScale, "scale"},
           {OdometryMode::kStereo, "stereo"}}};
}
constexpr std::array<std::pair<Backend, const char*>, 2> enum_names(Backend) {
  return {{{Backend::kDirect, "direct"}, {Backend::kFeatures, "features"}}};
}
constexpr std::array<std::pair<InitMethod, const char*>, 3> enum_names(InitMethod) {
  return {{{InitMethod::kAuto, "auto"},
           {InitMethod::kStereo, "stereo"},
           {InitMethod::kTwoView, "two_view"}}};
}
constexpr std::array<std::pair<DepthInit, const char*>, 3> enum_names(DepthInit) {
  return {{{DepthInit::kTemporal, "temporal"},
           {DepthInit::kStereo, "stereo"},
           {DepthInit::kAuto, "auto"}}};
}

constexpr std::array<std::pair<Lighting, const char*>, 3> enum_names(Lighting) {
  return {
      {{Lighting::kAuto, "auto"}, {Lighting::kWorld, "world"}, {Lighting::kVehicle, "vehicle"}}};
}

struct StereoOdometryConfig {
  OdometryMode mode = OdometryMode::kScale;
  Backend backend = Backend::kDirect;
  InitMethod init = InitMethod::kAuto;
  double init_min_matched = 0.3;  ///< Share of good static matches that `auto` asks for.
  DepthInit depth_init = DepthInit::kStereo;
  StereoAssistConfig assist;
  Lighting lighting = Lighting::kAuto;
  MovingLightConfig moving_light;
  LocalContrastConfig local_contrast;
  int downscale = 1;           ///< Whole number by which input images are reduced.
  int max_halvings = 2;        ///< Images in which no map can begin are halved so often at most.
  bool deterministic = false;  ///< All stages in order on the caller's thread.
  int threads = 2;             ///< Of the loops inside the stages; changes no bit of the result.
  int seed = 0;
  int mapping_queue = 4;          ///< Live: frames that may wait for mapping before one is dropped.
  bool wait_for_mapping = false;  ///< Live: wait instead of dropping.
  int lost_frames = 5;  ///< Frames in a row without a pose after which a new segment begins.
  double max_acceleration = 100.0;  ///< A pose that takes more is none [m/s^2]; 0: any is taken.
  RecognitionConfig recognition;
  bool exposure_motion = true;  ///< The motion between a pair's exposures is undone.
  /// Of a rolling shutter, from the upmost row to the lowest; negative where that comes first.
  double readout_ms = 0.0;
  double scale_timeout_s = 3.0;  ///< Without an accepted scale: state SCALE_UNOBSERVED.
  DirectConfig vo;
  FeatureConfig features;
  ScaleOptimizerConfig scale;
  ScaleFilterConfig filter;
  RightTurnConfig right_turn;
  StaticMatcherConfig matcher;
  UndistortionConfig undistortion;

  template <class Visitor>
  void visit(Visitor& v) {
    v("mode", mode, "who owns the metric scale");
    v("backend", backend, "which monocular odometry follows the left camera");
    v("init", init, "how the map begins");
    v("init_min_matched", init_min_matched,
      "share of good static matches that init: auto asks for");
    v("depth_init", depth_init, "where a new point's first depth interval comes from");
    v("assist", assist, "depth_init: auto, when stereo matching helps");
    v("lighting", lighting,
      "what lights the scene: world for the sun, vehicle for lamps that move with the cameras; "
      "auto finds out");
    v("moving_light", moving_light, "lighting: auto, when lamps are believed to move along");
    v("local_contrast", local_contrast,
      "where lamps move along, how images are freed of their light");
    v("downscale", downscale, "whole number by which input images are reduced");
    v("max_halvings", max_halvings,
      "images that are too blurred, noisy or pale for a map to begin are halved so often at most");
    v("deterministic", deterministic, "all stages in order on one thread");
    v("threads", threads, "of the loops inside the stages; changes no bit of the result");
    v("seed", seed, "of every random choice");
    v("mapping_queue", mapping_queue, "frames that may wait for mapping before one is dropped");
    v("wait_for_mapping", wait_for_mapping, "wait for mapping instead of dropping frames");
    v("lost_frames", lost_frames,
      "frames in a row without a pose that begin a new segment, at the latest");
    v("max_acceleration", max_acceleration,
      "a pose that takes more since the frames before is none, and of poses that fit alike "
      "one that takes more than a tenth is unlikely [m/s^2]; 0: neither");
    v("recognition", recognition, "a lost camera finds where it is by what it saw last");
    v("exposure_motion", exposure_motion,
      "cameras that are not triggered together: the motion between the exposures is undone");
    v("readout_ms", readout_ms,
      "rolling shutters: from the exposure of the upmost row to that of the lowest [ms]; 0: at "
      "once");
    v("scale_timeout_s", scale_timeout_s, "without an accepted scale: SCALE_UNOBSERVED [s]");
    v("vo", vo, "direct monocular odometry");
    v("features", features, "feature-based monocular odometry");
    v("scale", scale, "scale optimization");
    v("filter", filter, "scale filter");
    v("right_turn", right_turn, "a right camera that is turned against its calibration");
    v("matcher", matcher, "static stereo matching");
    v("undistortion", undistortion, "undistortion of the left image");
  }
};

/// What belongs to the cameras.
struct StereoCameras {
  StereoRig rig;  ///< Raw cameras, as calibrated, at full resolution.
  PhotometricCalibration left_photometric;
  PhotometricCalibration right_photometric;
  ImageU8 left_mask;  ///< 0 where the image must not be used; empty: all is used.
  ImageU8 right_mask;
};

/// Stereo visual odometry: direct monocular tracking and mapping on the left camera, and scale
/// optimization with the right one.
///
/// Deterministic: `process` does everything before it returns. Live: `process` tracks the frame
/// and publishes its pose; mapping and scale optimization run on threads of their own.
class StereoOdometry {
 public:
  /// `sink` must outlive the odometry; `observer` may be null. Throws std::invalid_argument for
  /// mode `stereo` with the backend `features`, which has no static residuals.
  StereoOdometry(const StereoOdometryConfig& config, const StereoCameras& cameras, OutputSink* sink,
                 StageObserver* observer = nullptr);
  ~StereoOdometry();
  StereoOdometry(const StereoOdometry&) = delete;
  StereoOdometry& operator=(const StereoOdometry&) = delete;

  /// Takes the next frame. Every frame yields exactly one `on_frame`, also refused ones.
  void process(const StereoFrame& frame);

  /// Waits until all work is done, and gives out the keyframes of the window as they are then; call
  /// before reading the trajectory. More frames may follow.
  void finish();

  /// Forgets the map and begins a new segment with the next frame.
  void reset();

  /// One pose a tracked frame, as refined until its keyframe left the window; similarities later
  /// than a keyframe's own are undone. Ascending stamps.
  std::vector<TrajectoryPose> refined_trajectory() const;

  /// The undistorted camera that is tracked, and the raw right one.
  const StereoRig& tracked_rig() const;
  const CameraModel& tracked_camera() const { return tracked_rig().left; }

  /// 0 where the tracked image must not be used; empty when all may be.
  const ImageU8& tracked_mask() const;

  /// How the right camera was found to be turned against the rig that was given, about its own
  /// centre (StereoRig::turned); the identity while it is taken as it was calibrated.
  SO3 right_turn() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sovo
