#include <filesystem>

#include "sovo/io/calibration_formats.h"

namespace sovo::calibration_formats {
namespace {

/// [fx fy cx cy] of a 3x3 camera matrix.
std::vector<double> intrinsics_of(const YamlField& field) {
  const MatX k = field.matrix(3, 3);
  return {k(0, 0), k(1, 1), k(0, 2), k(1, 2)};
}

/// Extrinsics: in this file, or in the one that OpenCV's stereo_calib sample writes beside it.
YamlField extrinsics_file(const YamlField& root) {
  if (root.find_any({"T", "translation"})) return root;
  for (const char* name : {"extrinsics.yml", "extrinsics.yaml"}) {
    const auto beside = std::filesystem::path(root.file()).parent_path() / name;
    if (std::filesystem::exists(beside)) return read_yaml_file(beside);
  }
  return root;
}

void read_image_size(const YamlField& root, CameraFields* fields) {
  if (const auto size = root.find_any({"image_size", "imageSize", "size", "resolution"})) {
    const std::vector<double> values = size->numbers(2);
    fields->width = static_cast<int>(values[0]);
    fields->height = static_cast<int>(values[1]);
    return;
  }
  const auto width = root.find_any({"image_width", "width"});
  const auto height = root.find_any({"image_height", "height"});
  if (width) fields->width = width->whole_number();
  if (height) fields->height = height->whole_number();
}

}  // namespace

Calibration parse_opencv(const YamlField& root, const CalibrationOptions& options) {
  CameraFields left;
  CameraFields right;
  read_image_size(root, &left);
  right = left;
  left.intrinsics = intrinsics_of(root.at_any({"M1", "K1", "cameraMatrix1"}));
  right.intrinsics = intrinsics_of(root.at_any({"M2", "K2", "cameraMatrix2"}));
  left.coefficients = root.at_any({"D1", "distCoeffs1"}).numbers();
  right.coefficients = root.at_any({"D2", "distCoeffs2"}).numbers();
  const auto model = root.find_any({"distortion_model", "model"});
  left.distortion_model = right.distortion_model = model ? model->text() : "radtan";
  Calibration calibration;
  calibration.format = "OpenCV";
  StereoRig& rig = calibration.rig;
  rig.name = "opencv";
  rig.left = make_camera(left, root);
  rig.right = make_camera(right, root);
  apply_size_options(options, &rig.left);
  apply_size_options(options, &rig.right);
  const YamlField extrinsics = extrinsics_file(root);
  const YamlField rotation = extrinsics.at_any({"R", "rotation"});
  MatX pose(3, 4);
  pose << rotation.matrix(3, 3), extrinsics.at_any({"T", "translation"}).matrix(3, 1);
  rig.T_right_left = rigid_from_matrix(pose, rotation.error("").what());
  return calibration;
}

}  // namespace sovo::calibration_formats
