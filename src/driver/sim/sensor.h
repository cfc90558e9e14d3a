#pragma once

#include <cstdint>
#include <vector>

#include "sovo/driver/sim/ray_table.h"
#include "sovo/driver/sim/renderer.h"
#include "sovo/driver/sim/sim_config.h"
#include "sovo/image/photometric.h"
#include "sovo/image/stereo_frame.h"

namespace sovo::sim {

/// Exposure of a camera, and the control that follows the light.
class ExposureControl {
 public:
  /// `suited_s`: exposure that shows a light of 1 as full scale [s].
  ExposureControl(const SensorConfig& config, double suited_s);

  double exposure_s() const { return exposure_s_; }
  double gain_db() const { return gain_db_; }
  /// Grey level of a light of 1, before response and vignette, over 255.
  double sensitivity() const;

  /// Settles on an image at once, as a camera does that has run for a while.
  void settle(const ImageF& light);
  /// Learns from an image that was given.
  void observe(const std::vector<std::uint8_t>& pixels);

 private:
  void scale_by(double factor);

  SensorConfig config_;
  double suited_s_;
  double exposure_s_;
  double gain_db_;
};

/// The factor on all light, `since_s` after the beginning.
float light_factor(const SensorConfig& config, double since_s);

/// What the air or the water and the lamps do to an image of light, `since_s` after the beginning.
void change_light(const SensorConfig& config, double since_s, ImageF* light);

/// One camera's sensor: vignette, exposure, noise, response, eight bits.
class Sensor {
 public:
  Sensor(const SensorConfig& config, int width, int height);

  /// Pixels of an image of light. Noise is that of `seed`. `dark`: no light comes in.
  std::vector<std::uint8_t> expose(const ImageF& light, const ExposureControl& exposure, bool dark,
                                   std::uint64_t seed) const;

  /// What a perfect calibration knows of it; empty when there is nothing to know.
  PhotometricCalibration photometric() const;

 private:
  SensorConfig config_;
  ImageF vignette_;
  std::vector<std::uint8_t> response_;  ///< Grey level of light in steps of 1/4096.
};

/// Blurs an image of light as motion during the exposure does: each pixel is the mean along the way
/// of what it shows. `velocity`: linear and angular velocity of the camera in its own frame [m/s,
/// rad/s].
void blur_by_motion(const RayTable& rays, const RenderedImage& image, const Vec6& velocity,
                    double exposure_s, ImageF* blurred);

}  // namespace sovo::sim
