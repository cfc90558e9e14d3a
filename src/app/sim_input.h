#pragma once

#include <memory>
#include <string>

#include "sovo/app/app_config.h"
#include "sovo/driver/sim/sim_source.h"

namespace sovo::app {

/// What the sections `sim` and `camera` say of simulated cameras. `rate`: speed against the world's
/// time, 0 as fast as pairs are rendered.
sim::SimConfig sim_options(const AppConfig& config, double rate);

/// The simulated cameras that the sections `sim` and `camera` describe, and says so in the log.
Result<std::unique_ptr<sim::SimSource>> open_sim_source(const AppConfig& config, double rate);

/// Writes all pairs to a folder that `sovo camera dataset` reads; returns an exit code.
int export_sim(const AppConfig& config, const std::string& directory, bool depth);

}  // namespace sovo::app
