#pragma once

#include <string>

#include "sovo/app/app_config.h"
#include "sovo/driver/dataset/dataset_source.h"

namespace sovo::app {

/// Speed as `DatasetOptions::rate` has it: "max" is 0, "auto" is `automatic`, else a positive
/// number.
Result<double> parse_rate(const std::string& text, double automatic);

/// Opens the dataset of the configuration and logs what was assumed about it. `automatic_rate`:
/// see `parse_rate`.
Result<std::unique_ptr<DatasetSource>> open_dataset_input(const CameraSection& camera,
                                                          double automatic_rate);

/// What the odometry needs of a calibration.
StereoCameras to_cameras(const Calibration& calibration);

}  // namespace sovo::app
