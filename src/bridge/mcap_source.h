#pragma once

#include <memory>
#include <optional>
#include <string>

#include "sovo/bridge/recorded_frames.h"
#include "sovo/driver/frame_source.h"
#include "sovo/io/recording.h"

namespace sovo::bridge {

/// What is read of a recording.
struct McapSourceConfig {
  std::string path;
  RecordedFramesConfig topics;
  std::optional<StereoCameras> calibration;  ///< Instead of the recorded one.
  int start = 0;                             ///< Frames left out at the beginning.
  int frames = 0;                            ///< At most; 0: all.
};

/// Stereo frames of a recording: ours, or any ROS 2 bag with the images of two cameras.
class McapSource : public FrameSource {
 public:
  static Result<std::unique_ptr<McapSource>> open(const McapSourceConfig& config);

  const StereoCameras& cameras() const { return cameras_; }
  const StereoRig& rig() const override { return cameras_.rig; }
  std::optional<std::size_t> size() const override { return size_; }
  /// Topics that the frames come from.
  std::string about() const { return frames_->about(); }
  /// Notes about the files, for the log.
  std::vector<std::string> notes() const { return recording_->notes(); }

  SourceResult next(std::chrono::milliseconds timeout) override;

 private:
  explicit McapSource(std::unique_ptr<Recording> recording) : recording_(std::move(recording)) {}

  std::unique_ptr<Recording> recording_;
  std::unique_ptr<RecordedFrames> frames_;  // reads recording_
  std::string path_;
  StereoCameras cameras_;
  std::size_t size_ = 0;
  std::size_t given_ = 0;
};

}  // namespace sovo::bridge
