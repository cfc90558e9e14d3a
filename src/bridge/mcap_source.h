#pragma once

#include <memory>
#include <optional>
#include <string>

#include "sovo/bridge/calibration_conversion.h"
#include "sovo/driver/frame_source.h"
#include "sovo/io/recording.h"

namespace sovo::bridge {

/// Stereo frames of a recording: its StereoFrame topic, with the calibration of its
/// StereoCalibration topic unless one is given.
class McapSource : public FrameSource {
 public:
  /// `start`: frames left out at the beginning; `frames`: at most, 0 for all.
  static Result<std::unique_ptr<McapSource>> open(const std::string& path,
                                                  std::optional<StereoCameras> calibration,
                                                  int start, int frames);

  const StereoCameras& cameras() const { return cameras_; }
  const StereoRig& rig() const override { return cameras_.rig; }
  std::optional<std::size_t> size() const override { return size_; }
  /// Notes about the files, for the log.
  std::vector<std::string> notes() const { return recording_->notes(); }

  SourceResult next(std::chrono::milliseconds timeout) override;

 private:
  explicit McapSource(std::unique_ptr<Recording> recording) : recording_(std::move(recording)) {}

  Result<void> find_calibration();

  std::unique_ptr<Recording> recording_;
  std::string path_;
  StereoCameras cameras_;
  std::size_t size_ = 0;
  std::size_t given_ = 0;
};

}  // namespace sovo::bridge
