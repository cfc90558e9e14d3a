#pragma once

#include <string>
#include <vector>

#include "message_traits.h"
#include "sovo/geometry/stereo_rig.h"
#include "sovo/image/stereo_rectification.h"
#include "sovo/io/result.h"

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

}  // namespace sovo::bridge
