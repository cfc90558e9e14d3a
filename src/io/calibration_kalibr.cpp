#include "sovo/io/calibration_formats.h"

namespace sovo::calibration_formats {
namespace {

CameraModel parse_camera(const YamlField& field) {
  const std::string model = field.at("camera_model").text();
  if (model != "pinhole") {
    throw field.at("camera_model")
        .error("is '" + model + "'; only pinhole cameras are read: calibrate with pinhole-radtan " +
               "or pinhole-equi");
  }
  CameraFields fields;
  const std::vector<double> size = field.at("resolution").numbers(2);
  fields.width = static_cast<int>(size[0]);
  fields.height = static_cast<int>(size[1]);
  fields.intrinsics = field.at("intrinsics").numbers(4);
  fields.distortion_model = field.at("distortion_model").text();
  fields.coefficients = field.at_any({"distortion_coeffs", "distortion_coefficients"}).numbers();
  return make_camera(fields, field);
}

SE3 parse_pose(const YamlField& field) {
  return rigid_from_matrix(field.matrix(4, 4), field.error("").what());
}

}  // namespace

Calibration parse_kalibr(const YamlField& root) {
  const YamlField cam0 = root.at("cam0");
  const YamlField cam1 = root.at("cam1");
  Calibration calibration;
  calibration.format = "Kalibr";
  StereoRig& rig = calibration.rig;
  rig.name = "kalibr";
  rig.left = parse_camera(cam0);
  rig.right = parse_camera(cam1);
  if (!cam1.has("T_cn_cnm1") && cam0.has("T_cam_imu") && cam1.has("T_cam_imu")) {
    rig.T_right_left =
        parse_pose(cam1.at("T_cam_imu")) * parse_pose(cam0.at("T_cam_imu")).inverse();
  } else {
    rig.T_right_left = parse_pose(cam1.at("T_cn_cnm1"));
  }
  if (cam0.has("T_cam_imu")) rig.T_base_left = parse_pose(cam0.at("T_cam_imu")).inverse();
  return calibration;
}

}  // namespace sovo::calibration_formats
