#pragma once

#include <array>
#include <string>
#include <vector>

#include "message_traits.h"
#include "sovo/io/result.h"
#include "sovo/odometry/stereo_odometry.h"

namespace sovo::bridge {

/// A StereoCalibration message with the arrays that it borrows (borrow.h).
class CalibrationMessage {
 public:
  /// `frame_id`: left optical frame.
  CalibrationMessage(const StereoCameras& cameras, const std::string& frame_id,
                     std::int64_t stamp_ns);
  CalibrationMessage(const CalibrationMessage&) = delete;
  CalibrationMessage& operator=(const CalibrationMessage&) = delete;

  const msg::StereoCalibration& message() const { return message_; }

 private:
  struct Camera {
    std::string distortion;
    std::vector<double> coefficients;
    std::vector<double> response;
    std::vector<std::uint16_t> vignette;
  };

  static msg::CameraModel fill(const CameraModel& camera, const PhotometricCalibration& photometric,
                               Camera* storage);

  std::string frame_id_;
  std::string name_;
  std::array<Camera, 2> cameras_;
  msg::StereoCalibration message_{};
};

/// Geometry of a camera that anyone may have described; `name` is for the error text.
Result<CameraModel> from_message(const msg::CameraModel& message, const std::string& name);

/// Rig and photometric calibration of a message that anyone may have sent; the error says which
/// field is wrong. Masks stay empty: they belong to the odometry, not to the camera.
Result<StereoCameras> from_message(const msg::StereoCalibration& message);

}  // namespace sovo::bridge
