#pragma once

#include <optional>

#include "sovo/driver/live/capture_device.h"
#include "sovo/image/stereo_frame.h"

namespace sovo {

struct AutoExposureConfig {
  double target_grey = 105.0;     ///< Mean grey level that is aimed at.
  double dead_band = 0.1;         ///< Share of the target that is near enough.
  double speed = 0.1;             ///< Share of an error mended at a time.
  double max_step = 0.05;         ///< Largest change of light a frame, as a share.
  int settle_frames = 4;          ///< Frames until a change shows.
  double min_exposure_s = 50e-6;  ///< Shortest exposure [s].
  double max_exposure_s = 10e-3;  ///< Longest exposure [s]; then gain rises.
  double max_gain_db = 12.0;      ///< Largest gain [dB].
  Exposure first{5e-3, 0.0};      ///< To begin with.
};

/// Exposure control for direct methods, which compare grey levels: cameras' own controls jump, and
/// two cameras' jump apart. Here both cameras share exposure and gain, and the light changes by at
/// most `max_step` at a time. Exposure goes first, gain after; gain is given up first.
class AutoExposure {
 public:
  explicit AutoExposure(const AutoExposureConfig& config) : config_(config), now_(config.first) {}

  /// Looks at a frame; an exposure to be set on both cameras, when it shall change. The first call
  /// gives the first one.
  std::optional<Exposure> observe(const StereoFrame& frame);

  /// Mean grey level of the frame last looked at; saturated pixels count double.
  double mean_grey() const { return mean_grey_; }
  const Exposure& exposure() const { return now_; }

 private:
  void scale_light(double factor);

  AutoExposureConfig config_;
  Exposure now_;
  bool begun_ = false;
  int wait_ = 0;  ///< Frames that still show the exposure before.
  double mean_grey_ = 0.0;
};

}  // namespace sovo
