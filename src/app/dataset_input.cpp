#include "sovo/app/dataset_input.h"

#include <spdlog/spdlog.h>

#include "sovo/io/text.h"

namespace sovo::app {

Result<double> parse_rate(const std::string& text, double automatic) {
  if (text == "auto") return automatic;
  if (text == "max") return 0.0;
  const auto rate = parse_double(text);
  if (rate && *rate > 0.0) return *rate;
  return Error{"camera.rate is '" + text + "'; it must be a positive number, max or auto"};
}

Result<std::unique_ptr<DatasetSource>> open_dataset_input(const CameraSection& camera,
                                                          double automatic_rate) {
  const auto rate = parse_rate(camera.rate, automatic_rate);
  if (!rate) return rate.failure();
  DatasetOptions options;
  options.path = camera.path;
  options.calibration = camera.calibration;
  options.reverse = camera.reverse;
  options.start_frame = camera.start;
  options.max_frames = camera.frames;
  options.rate = *rate;
  options.restamp = camera.restamp;
  options.frame_rate = camera.frame_rate;
  options.frame_id.clear();  // the publisher names it
  auto source = open_dataset(options);
  if (!source) return source;
  for (const std::string& note : (*source)->notes()) spdlog::info("{}", note);
  const StereoRig& rig = (*source)->rig();
  spdlog::info("{}: {}, {} frames of {}x{}, baseline {:.3f} m", camera.path,
               to_string((*source)->layout()), (*source)->size().value_or(0), rig.left.width,
               rig.left.height, rig.baseline());
  return source;
}

StereoCameras to_cameras(const Calibration& calibration) {
  return {calibration.rig, calibration.left_photometric, calibration.right_photometric,
          calibration.left_mask, calibration.right_mask};
}

}  // namespace sovo::app
