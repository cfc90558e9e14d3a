#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "sovo/app/app_config.h"
#include "sovo/app/frame_input.h"
#include "sovo/app/profile_report.h"
#include "sovo/io/result.h"
#include "sovo/loop/loop_closer.h"

namespace sovo::app {

/// Everything that a run leaves.
struct RunResults {
  std::vector<TrajectoryPose> refined;
  std::vector<TrajectoryPose> corrected;  ///< The same in `map`; where loops are closed.
  std::optional<LoopCounts> loops;        ///< Likewise.
  const RunRecorder* recorder = nullptr;
  const ProfileCollector* profile = nullptr;
  ProfileContext context;
  StereoRig rig;  ///< As it was given, with the right camera as it was found to be turned.
  StampMap original_stamp;  ///< Empty: stamps are the dataset's already.
};

/// Whether every file can be written, before hours are spent.
Result<void> check_outputs(const OutputSection& output);

/// Writes the files that were asked for, lines in ascending order of the dataset's stamps.
Result<void> write_outputs(const OutputSection& output, const RunResults& results);

}  // namespace sovo::app
