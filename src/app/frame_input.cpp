#include "sovo/app/frame_input.h"

#include <spdlog/spdlog.h>

#include <algorithm>

#include "sovo/app/sim_input.h"
#include "sovo/driver/dataset/dataset_source.h"
#include "sovo/io/text.h"

namespace sovo::app {
namespace {

/// The true poses of a simulated run.
Result<void> write_truth(const sim::SimSource& source, const std::string& path,
                         bool original_stamps) {
  Trajectory truth = source.truth();
  if (original_stamps) {
    for (StampedPose& pose : truth) pose.stamp_ns = source.original_stamp(pose.stamp_ns);
    std::sort(truth.begin(), truth.end(),
              [](const StampedPose& a, const StampedPose& b) { return a.stamp_ns < b.stamp_ns; });
  }
  return write_tum(path, truth, "simulated: t tx ty tz qx qy qz qw of the left camera");
}

}  // namespace

Result<double> parse_rate(const std::string& text, double automatic) {
  if (text == "auto") return automatic;
  if (text == "max") return 0.0;
  const auto rate = parse_double(text);
  if (rate && *rate > 0.0) return *rate;
  return Error{"camera.rate is '" + text + "'; it must be a positive number, max or auto"};
}

Result<FrameInput> open_dataset_input(const CameraSection& camera, double automatic_rate) {
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
  if (!source) return source.failure();
  for (const std::string& note : (*source)->notes()) spdlog::info("{}", note);
  const StereoRig& rig = (*source)->rig();
  spdlog::info("{}: {}, {} frames of {}x{}, baseline {:.3f} m", camera.path,
               to_string((*source)->layout()), (*source)->size().value_or(0), rig.left.width,
               rig.left.height, rig.baseline());
  const DatasetSource* dataset = source->get();
  FrameInput input;
  input.cameras = to_cameras(dataset->calibration());
  input.original_stamp = [dataset](std::int64_t fed) { return dataset->original_stamp(fed); };
  input.rate = *rate;
  input.source = std::move(*source);
  return input;
}

Result<FrameInput> open_sim_input(const AppConfig& config, double automatic_rate,
                                  bool original_stamps) {
  const auto rate = parse_rate(config.camera.rate, automatic_rate);
  if (!rate) return rate.failure();
  auto source = open_sim_source(config, *rate);
  if (!source) return source.failure();
  sim::SimSource* world = source->get();
  FrameInput input;
  input.cameras = to_cameras(world->calibration());
  input.original_stamp = [world](std::int64_t fed) { return world->original_stamp(fed); };
  input.rate = *rate;
  input.begin = [world, truth = config.output.truth, original_stamps]() -> Result<void> {
    world->begin();
    return truth.empty() ? Result<void>() : write_truth(*world, truth, original_stamps);
  };
  input.source = std::move(*source);
  return input;
}

StereoCameras to_cameras(const Calibration& calibration) {
  return {calibration.rig, calibration.left_photometric, calibration.right_photometric,
          calibration.left_mask, calibration.right_mask};
}

}  // namespace sovo::app
