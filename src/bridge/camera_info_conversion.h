#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "message_traits.h"
#include "sovo/geometry/stereo_rig.h"
#include "sovo/image/stereo_rectification.h"
#include "sovo/io/result.h"
#include "sovo/odometry/stereo_odometry.h"

namespace sovo::bridge {

/// A CameraInfo message with the arrays that it borrows (borrow.h): K and D of the raw camera, R
/// and P of the rectified one; p[3] of the right camera is -fx * baseline.
class CameraInfoMessage {
 public:
  CameraInfoMessage(const StereoRig& rig, const StereoRectification& rectification, bool is_left,
                    const std::string& frame_id);
  CameraInfoMessage(const CameraInfoMessage&) = delete;
  CameraInfoMessage& operator=(const CameraInfoMessage&) = delete;

  /// The message with the stamp of an image.
  const msg::CameraInfo& at(std::int64_t stamp_ns);

 private:
  std::string frame_id_;
  std::string distortion_;
  std::vector<double> coefficients_;
  msg::CameraInfo message_{};
};

/// A CameraInfo message that lies in memory of its own.
struct CameraInfoCopy {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::string distortion_model;
  std::vector<double> d;
  std::array<double, 9> k{};
  std::array<double, 9> r{};
  std::array<double, 12> p{};
};

CameraInfoCopy copy(const msg::CameraInfo& message);

/// The rig of two CameraInfo messages that anyone may have sent; the error says what is wrong.
/// Raw images have intrinsics `k` and distortion `d`; `rectified` ones those of `p`. Extrinsics are
/// those of `r` and `p`. The base frame lies in the left camera.
Result<StereoCameras> cameras_from(const CameraInfoCopy& left, const CameraInfoCopy& right,
                                   bool rectified);

}  // namespace sovo::bridge
