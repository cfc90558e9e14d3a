#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "sovo/bridge/ros_image_converter.h"
#include "sovo/image/stereo_frame.h"
#include "sovo/io/recording_writer.h"
#include "sovo/odometry/stereo_odometry.h"

namespace sovo::bridge {

/// Writes stereo frames into a recording, as a camera process and a recorder would have:
///
///     StereoRecording recording(writer, "sovo", true);
///     recording.begin(cameras, start_ns);
///     recording.write(frame, log_ns);
///
/// The same frames give the same bytes.
class StereoRecording {
 public:
  /// `ns`: namespace of the topics; `ros_images`: Image and CameraInfo instead of StereoFrame.
  StereoRecording(RecordingWriter& writer, const std::string& ns, bool ros_images);

  /// Writes the calibration, as message and as attachment.
  Result<void> begin(const StereoCameras& cameras, std::uint64_t log_ns);
  /// An empty `frame_id` becomes the left optical frame. `publish_ns` is the frame's stamp.
  Result<void> write(const StereoFrame& frame, std::uint64_t log_ns);

 private:
  RecordingWriter& writer_;
  std::string ns_;
  std::string left_frame_;
  RecordingTopic stereo_;
  RecordingTopic calibration_;
  std::unique_ptr<RosImageConverter> converter_;  // null: frames stay what they are
};

}  // namespace sovo::bridge
