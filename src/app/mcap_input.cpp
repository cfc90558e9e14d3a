#include "sovo/app/mcap_input.h"

#include <spdlog/spdlog.h>

#include "sovo/bridge/mcap_source.h"

namespace sovo::app {

Result<FrameInput> open_mcap_input(const AppConfig& config) {
  const CameraSection& camera = config.camera;
  if (camera.reverse) return Error{"a recording cannot be run backwards; leave --reverse out"};
  const auto rate = parse_rate(camera.rate, 0.0);
  if (!rate) return rate.failure();
  if (*rate != 0.0) {
    return Error{
        "sovo run goes through a recording as fast as it can; for real time use sovo "
        "replay and sovo vo"};
  }
  bridge::McapSourceConfig wanted;
  wanted.path = camera.mcap;
  wanted.topics = {config.node.left, config.node.right, config.node.pair_tolerance_s};
  wanted.start = camera.start;
  wanted.frames = camera.frames;
  if (!camera.calibration.empty()) {
    auto calibration = load_calibration(camera.calibration);
    if (!calibration) return calibration.failure();
    wanted.calibration = to_cameras(*calibration);
  }
  auto source = bridge::McapSource::open(wanted);
  if (!source) return source.failure();
  for (const std::string& note : (*source)->notes()) spdlog::warn("{}", note);
  const StereoRig& rig = (*source)->rig();
  spdlog::info("{}: {}, {} frames of {}x{}, baseline {:.3f} m", camera.mcap, (*source)->about(),
               *(*source)->size(), rig.left.width, rig.left.height, rig.baseline());
  FrameInput input;
  input.cameras = (*source)->cameras();
  input.original_stamp = [](std::int64_t fed) { return fed; };
  input.source = std::move(*source);
  return input;
}

}  // namespace sovo::app
