#include "sovo/bridge/camera_info_conversion.h"

#include <algorithm>

#include "sovo/bridge/borrow.h"
#include "sovo/bridge/ros_conversion.h"

namespace sovo::bridge {
namespace {

/// Name and coefficients as ROS has them: plumb_bob has five.
std::string ros_distortion(const CameraModel& camera, std::vector<double>* coefficients) {
  const int given = camera.num_coefficients;
  coefficients->assign(camera.d.begin(), camera.d.begin() + given);
  if (camera.distortion == Distortion::kEquidistant) return "equidistant";
  if (camera.distortion == Distortion::kRadtan && given > 5) return "rational_polynomial";
  coefficients->resize(5, 0.0);
  if (camera.distortion == Distortion::kNone) std::fill_n(coefficients->begin(), 5, 0.0);
  return "plumb_bob";
}

void set_intrinsics(const CameraModel& camera, int columns, double* matrix) {
  matrix[0] = camera.fx;
  matrix[2] = camera.cx;
  matrix[columns + 1] = camera.fy;
  matrix[columns + 2] = camera.cy;
  matrix[2 * columns + 2] = 1.0;
}

}  // namespace

CameraInfoMessage::CameraInfoMessage(const StereoRig& rig, const StereoRectification& rectification,
                                     bool is_left, const std::string& frame_id)
    : frame_id_(frame_id) {
  const CameraModel& raw = is_left ? rig.left : rig.right;
  const CameraModel& rectified = is_left ? rectification.left : rectification.right;
  const Mat3& R = is_left ? rectification.R_left : rectification.R_right;
  distortion_ = ros_distortion(raw, &coefficients_);
  msg::CameraInfo& m = message_;
  m.header.frame_id = borrow(frame_id_);
  m.width = static_cast<std::uint32_t>(raw.width);
  m.height = static_cast<std::uint32_t>(raw.height);
  m.distortion_model = borrow(distortion_);
  borrow(m.d, coefficients_);
  set_intrinsics(raw, 3, m.k);
  set_intrinsics(rectified, 4, m.p);
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) m.r[3 * r + c] = R(r, c);
  }
  if (!is_left) {
    m.p[3] = rectified.fx * rectification.t_right_left.x();
    m.p[7] = rectified.fy * rectification.t_right_left.y();
  }
}

const msg::CameraInfo& CameraInfoMessage::at(std::int64_t stamp_ns) {
  message_.header.stamp = to_message(stamp_ns);
  return message_;
}

}  // namespace sovo::bridge
