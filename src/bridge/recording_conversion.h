#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sovo/bridge/image_pairer.h"
#include "sovo/bridge/recorded_frames.h"
#include "sovo/bridge/ros_image_converter.h"
#include "sovo/bridge/stereo_recording.h"
#include "sovo/io/recording.h"
#include "sovo/io/recording_writer.h"

namespace sovo::bridge {

/// What becomes of the stereo frames of a recording that is converted.
enum class FrameForm {
  kAsRecorded,
  kRosImages,     ///< StereoFrame becomes Image and CameraInfo.
  kStereoFrames,  ///< The images of two cameras become StereoFrame.
};

struct RecordingConversionConfig {
  FrameForm frames = FrameForm::kAsRecorded;
  RecordedFramesConfig topics;               ///< For kStereoFrames.
  std::string ns = "sovo";                   ///< Namespace of topics that are new.
  std::optional<StereoCameras> calibration;  ///< For kStereoFrames, instead of the recorded one.
};

/// Copies a recording message by message, with all times and attachments, into one that is written
/// with another compression, split or form of its frames. The same recording gives the same bytes.
class RecordingConversion {
 public:
  RecordingConversion(Recording& from, RecordingWriter& to, RecordingConversionConfig config)
      : from_(from), to_(to), config_(std::move(config)) {}

  /// `progress` is called after each message with how many were read; false stops.
  Result<void> run(const std::function<bool(std::uint64_t)>& progress);

  /// What was left out and why, for people.
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  Result<void> copy_attachments();
  void copy_drops();
  Result<void> prepare_ros_images();
  Result<void> prepare_stereo_frames();
  Result<void> convert(const RecordedMessage& message);
  Result<void> write_images(const RosImageConverter& converter, const RecordedMessage& message);
  Result<void> write_pairs(std::uint64_t log_ns);
  Result<void> copy_message(const RecordedMessage& message);
  void note(const std::string& text);

  Recording& from_;
  RecordingWriter& to_;
  RecordingConversionConfig config_;
  std::map<std::string, std::unique_ptr<RosImageConverter>> converters_;  // by StereoFrame topic
  std::optional<ImagePairer> pairer_;
  std::optional<StereoRecording> stereo_;
  std::vector<std::string> notes_;
};

}  // namespace sovo::bridge
