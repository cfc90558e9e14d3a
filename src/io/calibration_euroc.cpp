#include <filesystem>

#include "sovo/io/calibration_formats.h"
#include "sovo/io/photometric_file.h"

namespace sovo::calibration_formats {
namespace {

namespace fs = std::filesystem;

struct Sensor {
  CameraModel camera;
  SE3 T_body_sensor;
};

Sensor parse_sensor(const std::string& path) {
  const YamlField root = read_yaml_file(path);
  if (root.has("camera_model") && root.at("camera_model").text() != "pinhole") {
    throw root.at("camera_model").error("must be pinhole");
  }
  CameraFields fields;
  const std::vector<double> size = root.at("resolution").numbers(2);
  fields.width = static_cast<int>(size[0]);
  fields.height = static_cast<int>(size[1]);
  fields.intrinsics = root.at("intrinsics").numbers(4);
  fields.distortion_model = root.at("distortion_model").text();
  fields.coefficients = root.at("distortion_coefficients").numbers();
  const YamlField pose = root.at("T_BS");
  return {make_camera(fields, root), rigid_from_matrix(pose.matrix(4, 4), pose.error("").what())};
}

/// Response and vignette in DSO's formats, as the TUM-VI benchmark ships them.
void add_photometric(const fs::path& folder, const CameraModel& camera,
                     PhotometricCalibration* photometric, ImageU8* mask) {
  if (fs::exists(folder / "pcalib.txt")) {
    photometric->inverse_response = value_or_throw(read_response(folder / "pcalib.txt"));
  }
  if (fs::exists(folder / "vignette.png")) {
    photometric->vignette =
        value_or_throw(read_vignette(folder / "vignette.png", camera.width, camera.height, mask));
  }
}

}  // namespace

Calibration parse_euroc(const std::string& mav_folder) {
  const fs::path mav(mav_folder);
  const Sensor left = parse_sensor(mav / "cam0" / "sensor.yaml");
  const Sensor right = parse_sensor(mav / "cam1" / "sensor.yaml");
  Calibration calibration;
  calibration.format = "EuRoC";
  StereoRig& rig = calibration.rig;
  rig.name = "euroc";
  rig.left = left.camera;
  rig.right = right.camera;
  rig.T_right_left = right.T_body_sensor.inverse() * left.T_body_sensor;
  rig.T_base_left = left.T_body_sensor;
  const fs::path dso = fs::absolute(mav).parent_path() / "dso";
  add_photometric(dso / "cam0", rig.left, &calibration.left_photometric, &calibration.left_mask);
  add_photometric(dso / "cam1", rig.right, &calibration.right_photometric, &calibration.right_mask);
  return calibration;
}

}  // namespace sovo::calibration_formats
