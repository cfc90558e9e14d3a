#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "sovo/app/app_config.h"
#include "sovo/driver/frame_source.h"
#include "sovo/io/calibration.h"

namespace sovo::app {

/// Brings a stamp that the odometry saw back to the one of the recording.
using StampMap = std::function<std::int64_t(std::int64_t)>;

/// A source of frames that ends, and what the commands must know of it.
struct FrameInput {
  std::unique_ptr<FrameSource> source;
  StereoCameras cameras;
  StampMap original_stamp;  ///< Uses `source`.
  double rate = 0.0;        ///< Speed against the recording; 0: as fast as can be.
  /// Starts the source's clock; to be called right before the first frame is asked for.
  std::function<Result<void>()> begin = [] { return Result<void>(); };
};

/// Speed as `DatasetOptions::rate` has it: "max" is 0, "auto" is `automatic`, else a positive
/// number.
Result<double> parse_rate(const std::string& text, double automatic);

/// Opens the dataset of the configuration and logs what was assumed about it. `automatic_rate`:
/// see `parse_rate`.
Result<FrameInput> open_dataset_input(const CameraSection& camera, double automatic_rate);

/// Builds the simulated world of the configuration. Its `begin` writes the true trajectory where
/// `output.truth` says, with the stamps that frames are given with (`original_stamps`: those of
/// the trajectory, whatever `reverse` and `restamp` make of them).
Result<FrameInput> open_sim_input(const AppConfig& config, double automatic_rate,
                                  bool original_stamps);

/// What the odometry needs of a calibration.
StereoCameras to_cameras(const Calibration& calibration);

}  // namespace sovo::app
