#include "sovo/bridge/camera_info_conversion.h"

#include <algorithm>
#include <cmath>

#include "sovo/bridge/borrow.h"
#include "sovo/bridge/calibration_conversion.h"
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

bool is_zero(double v) { return v == 0.0; }

/// Coefficients as many as they count: a model of zeros is none, and OpenCV's thin prism and tilt
/// after the eighth are usually zero.
std::string own_distortion(const CameraInfoCopy& info, std::vector<double>* coefficients) {
  *coefficients = info.d;
  while (coefficients->size() > 8 && coefficients->back() == 0.0) coefficients->pop_back();
  if (std::all_of(info.d.begin(), info.d.end(), is_zero) &&
      info.distortion_model != "equidistant") {
    coefficients->clear();
    return "none";
  }
  return info.distortion_model;
}

Result<CameraModel> camera_of(const CameraInfoCopy& info, bool rectified, const std::string& name) {
  if (info.k[0] == 0.0) return Error{name + " camera is not calibrated (k[0] is 0)"};
  std::vector<double> coefficients;
  const std::string distortion = rectified ? "none" : own_distortion(info, &coefficients);
  msg::CameraModel m{};
  m.width = info.width;
  m.height = info.height;
  m.model = borrow("pinhole");
  m.distortion_model = borrow(distortion);
  borrow(m.d, coefficients);
  const int columns = rectified ? 4 : 3;
  const double* matrix = rectified ? info.p.data() : info.k.data();
  m.fx_fy_cx_cy[0] = matrix[0];
  m.fx_fy_cx_cy[1] = matrix[columns + 1];
  m.fx_fy_cx_cy[2] = matrix[2];
  m.fx_fy_cx_cy[3] = matrix[columns + 2];
  return from_message(m, name);
}

/// Raw optical frame into the rectified one.
Result<SO3> rectifying_rotation(const CameraInfoCopy& info, const std::string& name) {
  Mat3 R;
  for (int i = 0; i < 9; ++i) R(i / 3, i % 3) = info.r[static_cast<std::size_t>(i)];
  const bool is_rotation = R.allFinite() && R.determinant() > 0.0 &&
                           (R * R.transpose() - Mat3::Identity()).norm() < 1e-3;
  if (!is_rotation) return Error{name + ".r is not a rotation; was it calibrated as stereo?"};
  return SO3(Eigen::Quaterniond(R).normalized());
}

/// Where the projection matrix puts the camera in the rectified frame of the left one, negated [m].
Vec3 shift_of(const CameraInfoCopy& info) {
  return {info.p[3] / info.p[0], info.p[7] / info.p[5], 0.0};
}

}  // namespace

CameraInfoCopy copy(const msg::CameraInfo& m) {
  CameraInfoCopy info;
  info.width = m.width;
  info.height = m.height;
  info.distortion_model = text_or_empty(m.distortion_model);
  info.d.assign(m.d._buffer, m.d._buffer + m.d._length);
  std::copy_n(m.k, 9, info.k.begin());
  std::copy_n(m.r, 9, info.r.begin());
  std::copy_n(m.p, 12, info.p.begin());
  return info;
}

Result<StereoCameras> cameras_from(const CameraInfoCopy& left, const CameraInfoCopy& right,
                                   bool rectified) {
  constexpr double kShortestBaseline = 1e-6;  // [m]; less is what rounding leaves of none
  constexpr double kLongestBaseline = 100.0;  // [m]; more is millimetres
  auto left_camera = camera_of(left, rectified, "left");
  if (!left_camera) return left_camera.failure();
  auto right_camera = camera_of(right, rectified, "right");
  if (!right_camera) return right_camera.failure();
  const auto R_left = rectifying_rotation(left, "left");
  if (!R_left) return R_left.failure();
  const auto R_right = rectifying_rotation(right, "right");
  if (!R_right) return R_right.failure();
  const Vec3 shift = shift_of(right) - shift_of(left);
  if (!shift.allFinite() || shift.norm() < kShortestBaseline || shift.norm() > kLongestBaseline) {
    return Error{
        "right.p has no baseline in metres (p[3] is -fx times the baseline); was it calibrated as "
        "stereo?"};
  }
  StereoCameras cameras;
  cameras.rig.left = *left_camera;
  cameras.rig.right = *right_camera;
  const SO3 R_right_rectified = rectified ? SO3() : R_right->inverse();
  const SO3 R_rectified_left = rectified ? SO3() : *R_left;
  cameras.rig.T_right_left = SE3(R_right_rectified * R_rectified_left, R_right_rectified * shift);
  return cameras;
}

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
