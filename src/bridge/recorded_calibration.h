#pragma once

#include <optional>
#include <string>

#include "sovo/bridge/image_topics.h"
#include "sovo/io/recording.h"
#include "sovo/odometry/stereo_odometry.h"

namespace sovo::bridge {

// Both go through the recording from its beginning: seek before reading on.

/// The cameras of the recording's StereoCalibration: the first message of `topic`, or of any topic
/// when it is empty.
Result<StereoCameras> read_stereo_calibration(Recording& recording, const std::string& topic = {});

/// The cameras whose images the two topics have: of the StereoCalibration in the same namespace
/// when the images are raw, else of camera_info beside them.
Result<StereoCameras> read_image_calibration(Recording& recording, const ImageTopics& topics);

/// Name of the StereoCalibration topic in the namespace of an image topic; nothing without one.
std::optional<std::string> calibration_of(const Recording& recording,
                                          const std::string& image_topic);

}  // namespace sovo::bridge
