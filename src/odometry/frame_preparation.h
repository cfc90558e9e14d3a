#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sovo/image/local_contrast.h"
#include "sovo/image/pyramid.h"
#include "sovo/image/pyramid_pool.h"
#include "sovo/image/stereo_frame.h"
#include "sovo/image/undistorter.h"
#include "sovo/image/unroller.h"
#include "sovo/image/vignette.h"
#include "sovo/odometry/stereo_odometry.h"
#include "sovo/vo/light_observers.h"
#include "sovo/vo/monocular_backend.h"
#include "sovo/vo/moving_light.h"
#include "sovo/vo/vignette_estimate.h"

namespace sovo {

/// From raw stereo frames to what is tracked: the left image undistorted, the right one as its
/// camera sees it, both photometrically corrected and reduced.
///
/// What a map is built from may be halved further, as often as `halvings` says; its pixel (x, y)
/// then covers 2^halvings of the whole image's in each direction, as in a pyramid.
class FramePreparation {
 public:
  FramePreparation(const StereoOdometryConfig& config, const StereoCameras& cameras);

  /// How often images can be halved: as the configuration has it, while they are large enough.
  int max_halvings() const { return static_cast<int>(resolutions_.size()) - 1; }

  /// Left: the tracked pinhole camera; right: raw, with distortion. Both reduced.
  const StereoRig& rig(int halvings = 0) const { return at(halvings).rig; }
  /// 0 where the tracked left image must not be used; empty when all may be.
  const ImageU8& left_mask(int halvings = 0) const { return at(halvings).left_mask; }

  /// What is wrong with a side: missing, of another size, black; empty when nothing is.
  std::string check_side(const SideImage& side, bool is_left) const;

  /// What is wrong with the exposure of a left image, so that little can be made of it: most of it
  /// is white or dark. Empty when nothing is. Precondition: as for `prepare_left`.
  static std::string exposure_problem(const SideImage& side);

  /// Left image ready to be tracked. `rate`: how a camera with a rolling shutter moves meanwhile
  /// (MonoFrame::rate). Precondition: `check_side` found nothing.
  MonoFrame prepare_left(const StereoFrame& frame, StageObserver* observer, int halvings = 0,
                         const Vec6& rate = Vec6::Zero());

  /// Right image ready for matching and scale optimization, in the memory of what `out` was before;
  /// rate and vignette are those of the left one.
  void prepare_right(const SideImage& right, int halvings, const MonoFrame& left,
                     ImagePyramid* out) const;

  /// For maps of images as they are prepared from now on.
  LightObservers light_observers() const;

  /// Whether the lamps were found to move along, and images still have their light.
  bool wants_light_out() const {
    return !left_contrast_ && moving_light_ && moving_light_->found();
  }
  /// Whether images are freed of their light from now on. Precondition: no thread prepares any.
  void take_light_out(bool out);

  /// OdometryOutput::corner_light.
  double corner_light() const;

  /// Whether rows are exposed one after the other.
  bool has_rolling_shutter() const { return readout_s_ != 0.0; }
  /// How far apart what is `rho` [1/m] near lies in images that are prepared with rates that differ
  /// so, at most [px].
  double displacement(const Vec6& rate_difference, double rho) const;

 private:
  struct Resolution {
    StereoRig rig;
    ImageU8 left_mask;
    /// Of the left camera, where it is behind a port; not in mode mono, whose unit is no metre.
    AxialRays rays;
  };
  const Resolution& at(int halvings) const {
    return resolutions_[static_cast<std::size_t>(halvings)];
  }
  void add_resolutions(const StereoRig& rig, const ImageU8& mask, int max_halvings);
  void write_left(const SideImage& left, const Vec3& turn, ImageF* image);
  ViewShift view_shift(const Vec6& rate, int halvings) const;
  /// Whether the pixels are resampled as they come, with nothing to be done before.
  bool takes_bytes(const SideImage& left) const;

  StereoCameras cameras_;
  int downscale_;
  int max_levels_;
  std::vector<Resolution> resolutions_;  ///< By the number of halvings.
  LocalContrastConfig local_contrast_;
  std::optional<LocalContrast> left_contrast_;  ///< Where images are freed of their light.
  std::optional<Undistorter> undistorter_;
  double readout_s_;
  std::optional<Unroller> left_unroller_, right_unroller_;  ///< With a rolling shutter.
  Unroller::Lattice left_lattice_;
  ImageF raw_left_;
  ImageF unhalved_left_;
  PyramidPool left_pyramids_;
  std::unique_ptr<MovingLight> moving_light_;  ///< With lighting: auto.
  std::unique_ptr<VignetteEstimate> vignette_estimate_;
  std::optional<VignetteCorrection> left_vignette_, right_vignette_;  ///< With an estimate.
};

/// Times a stage and reports it when it goes out of scope.
class ScopedStage {
 public:
  ScopedStage(StageObserver* observer, Stage stage);
  ~ScopedStage();
  ScopedStage(const ScopedStage&) = delete;
  ScopedStage& operator=(const ScopedStage&) = delete;

 private:
  StageObserver* observer_;
  Stage stage_;
  std::int64_t start_ns_;
};

}  // namespace sovo
