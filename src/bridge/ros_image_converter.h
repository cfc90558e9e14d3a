#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "sovo/bridge/camera_info_conversion.h"
#include "sovo/io/recording_writer.h"

namespace sovo::bridge {

/// Turns serialized StereoFrame messages into serialized Image and CameraInfo messages, both sides
/// with the stamp of the frame: "/sovo/stereo" becomes "/sovo/left/image_raw",
/// "/sovo/left/camera_info" and those of the right camera. Pixels, sizes and encodings stay as they
/// are; exposure, gain and the numbers of frames have no place in Image.
class RosImageConverter {
 public:
  explicit RosImageConverter(const std::string& stereo_topic);
  RosImageConverter(const RosImageConverter&) = delete;
  RosImageConverter& operator=(const RosImageConverter&) = delete;

  struct Message {
    const RecordingTopic* topic = nullptr;  ///< Lives as long as the converter.
    Bytes data;
  };

  const std::string& stereo_topic() const { return stereo_topic_; }
  /// Whether `topic` is one of those that it gives.
  bool makes(const std::string& topic) const;

  /// `bytes`: a StereoCalibration message. From then on there is CameraInfo.
  Result<void> take_calibration(ByteSpan bytes);
  /// `bytes`: a StereoFrame message. What stands for it: nothing for a side that is missing.
  Result<std::vector<Message>> convert(ByteSpan bytes) const;

 private:
  struct Side {
    RecordingTopic image;
    RecordingTopic info;
    mutable std::optional<CameraInfoMessage> info_message;  // holds the stamp given last
  };

  std::string stereo_topic_;
  std::array<Side, 2> sides_;
};

/// "..._right_..." of the left optical frame's name.
std::string right_frame_of(std::string left_frame);

}  // namespace sovo::bridge
