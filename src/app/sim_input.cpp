#include "sovo/app/sim_input.h"

#include <spdlog/spdlog.h>

#include "sovo/app/failure.h"
#include "sovo/app/progress.h"
#include "sovo/app/stop_signal.h"
#include "sovo/driver/sim/sim_export.h"
#include "sovo/io/config_schema.h"

namespace sovo::app {

sim::SimConfig sim_options(const AppConfig& config, double rate) {
  sim::SimConfig options = config.sim;
  const CameraSection& camera = config.camera;
  options.calibration = camera.calibration;
  options.start = camera.start;
  options.frames = camera.frames;
  options.rate = rate;
  options.reverse = camera.reverse;
  options.restamp = camera.restamp;
  options.frame_id.clear();  // the publisher names it
  return options;
}

Result<std::unique_ptr<sim::SimSource>> open_sim_source(const AppConfig& config, double rate) {
  const sim::SimConfig options = sim_options(config, rate);
  auto source = sim::open_sim(options);
  if (!source) return source;
  const StereoRig& rig = (*source)->rig();
  spdlog::info("simulated {}: {} pairs of {}x{} at {} Hz along {:.1f} m, baseline {:.3f} m",
               name_of(options.world), (*source)->size().value_or(0), rig.left.width,
               rig.left.height, (*source)->frame_rate(), (*source)->motion().length_m(),
               rig.baseline());
  return source;
}

int export_sim(const AppConfig& config, const std::string& directory, bool depth) {
  StopSignal stop;  // before the threads of the source
  auto source = open_sim_source(config, 0.0);
  if (!source) return fail(kBadInput, source.error());
  Progress progress((*source)->size());
  bool stopped = false;
  const auto written = sim::export_dataset(source->get(), directory, depth, [&](std::size_t pairs) {
    progress.update(pairs, directory);
    if (!progress.enabled() && pairs % 100 == 0) spdlog::info("{} pairs rendered", pairs);
    stopped = stop.requested();
    return !stopped;
  });
  if (!written) return fail(kFailed, written.error());
  if (stopped) spdlog::warn("stopped by the user; {} holds the pairs so far", directory);
  spdlog::info("read it with: sovo run --dataset {0}, or sovo camera dataset --path {0}",
               directory);
  return kOk;
}

}  // namespace sovo::app
