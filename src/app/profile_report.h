#pragma once

#include <optional>
#include <string>

#include "sovo/app/profile_collector.h"
#include "sovo/app/run_recorder.h"
#include "sovo/image/lanes.h"
#include "sovo/loop/loop_closer.h"

namespace sovo::app {

/// Circumstances of a run that belong beside its times.
struct ProfileContext {
  int threads = 1;
  std::string kernels = lanes_name();  ///< Registers of the inner loops.
};

/// The times by stage as lines for the terminal.
std::string timing_table(const ProfileCollector& profile);

/// The times, the work counters, peak memory and threads as JSON, indented.
std::string profile_json(const ProfileCollector& profile, const RunCounts& counts,
                         const ProfileContext& context);

/// What the run amounted to, as lines for the terminal.
std::string run_summary(const ProfileCollector& profile, const RunCounts& counts,
                        const std::optional<LoopCounts>& loops = std::nullopt);

}  // namespace sovo::app
