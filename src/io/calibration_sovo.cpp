#include <filesystem>

#include "sovo/io/calibration_formats.h"
#include "sovo/io/photometric_file.h"
#include "sovo/io/yaml_config.h"

namespace sovo {
namespace {

namespace fs = std::filesystem;

/// A camera as our file has it.
struct CameraSection {
  int width = 0;
  int height = 0;
  double fx = 0.0;
  double fy = 0.0;
  double cx = 0.0;
  double cy = 0.0;
  std::string distortion = "none";
  std::vector<double> coefficients;
  std::string response;
  std::string vignette;
  std::string mask;

  template <class Visitor>
  void visit(Visitor& v) {
    v("width", width, "[px]");
    v("height", height, "[px]");
    v("fx", fx, "[px]");
    v("fy", fy, "[px]");
    v("cx", cx, "[px], pixel centres at whole numbers");
    v("cy", cy, "[px]");
    v("distortion", distortion, "none, radtan or equidistant");
    v("coefficients", coefficients,
      "radtan: k1 k2 p1 p2 [k3 [k4 k5 k6]]; equidistant: k1 k2 k3 k4");
    v("response", response, "file beside this one: 256 values, the inverse response; or empty");
    v("vignette", vignette, "image beside this one, 8 or 16 bit; or empty");
    v("mask", mask, "image beside this one, 0 where not to look; or empty");
  }
};

struct CalibrationFile {
  int version = 1;
  std::string name;
  CameraSection left;
  CameraSection right;
  std::vector<double> T_right_left;
  std::vector<double> T_base_left;

  template <class Visitor>
  void visit(Visitor& v) {
    v("sovo_calibration", version, "version of this format");
    v("name", name, "of the rig");
    v("left", left, "left camera, raw");
    v("right", right, "right camera, raw");
    v("T_right_left", T_right_left, "rows of [R | t], left optical frame into the right one [m]");
    v("T_base_left", T_base_left,
      "rows of [R | t], left optical frame into the base frame (x forward, y left, z up) [m]");
  }
};

CameraSection section_of(const CameraModel& camera) {
  CameraSection section;
  section.width = camera.width;
  section.height = camera.height;
  section.fx = camera.fx;
  section.fy = camera.fy;
  section.cx = camera.cx;
  section.cy = camera.cy;
  section.distortion = to_string(camera.distortion);
  section.coefficients.assign(camera.d.begin(), camera.d.begin() + camera.num_coefficients);
  return section;
}

std::vector<double> rows_of(const SE3& pose) {
  std::vector<double> values;
  const Mat4 m = pose.matrix();
  for (int i = 0; i < 12; ++i) values.push_back(m(i / 4, i % 4));
  return values;
}

SE3 pose_of(const std::vector<double>& values, const std::string& where) {
  if (values.size() != 12 && values.size() != 16) {
    throw FormatError(where + "has " + std::to_string(values.size()) +
                      " numbers; the 12 of [R | t] are needed, row by row");
  }
  MatX m(static_cast<int>(values.size() / 4), 4);
  for (std::size_t i = 0; i < values.size(); ++i) {
    m(static_cast<int>(i / 4), static_cast<int>(i % 4)) = values[i];
  }
  return calibration_formats::rigid_from_matrix(m, where);
}

CameraModel camera_of(const CameraSection& section, const YamlField& where) {
  calibration_formats::CameraFields fields;
  fields.width = section.width;
  fields.height = section.height;
  fields.intrinsics = {section.fx, section.fy, section.cx, section.cy};
  fields.distortion_model = section.distortion;
  fields.coefficients = section.coefficients;
  return calibration_formats::make_camera(fields, where);
}

void read_images(const CameraSection& section, const fs::path& folder, const CameraModel& camera,
                 PhotometricCalibration* photometric, ImageU8* mask) {
  using calibration_formats::value_or_throw;
  if (!section.mask.empty()) {
    *mask = value_or_throw(read_mask(folder / section.mask, camera.width, camera.height));
  }
  if (!section.response.empty()) {
    photometric->inverse_response = value_or_throw(read_response(folder / section.response));
  }
  if (!section.vignette.empty()) {
    photometric->vignette =
        value_or_throw(read_vignette(folder / section.vignette, camera.width, camera.height, mask));
  }
}

}  // namespace

namespace calibration_formats {

Calibration parse_sovo(const std::string& text, const std::string& path) {
  CalibrationFile file;
  if (const auto loaded = load_config_text(text, path, &file); !loaded) {
    throw FormatError(loaded.error());
  }
  if (file.version != 1) {
    throw FormatError(path + ": sovo_calibration is version " + std::to_string(file.version) +
                      "; this program reads version 1");
  }
  const YamlField root = read_yaml_file(path);
  Calibration calibration;
  calibration.format = "sovo";
  StereoRig& rig = calibration.rig;
  rig.name = file.name;
  rig.left = camera_of(file.left, root.at("left"));
  rig.right = camera_of(file.right, root.at("right"));
  rig.T_right_left = pose_of(file.T_right_left, path + ": 'T_right_left' ");
  if (!file.T_base_left.empty()) {
    rig.T_base_left = pose_of(file.T_base_left, path + ": 'T_base_left' ");
  }
  const fs::path folder = fs::path(path).parent_path();
  read_images(file.left, folder, rig.left, &calibration.left_photometric, &calibration.left_mask);
  read_images(file.right, folder, rig.right, &calibration.right_photometric,
              &calibration.right_mask);
  return calibration;
}

}  // namespace calibration_formats

std::string format_sovo_calibration(const StereoRig& rig) {
  CalibrationFile file;
  file.name = rig.name;
  file.left = section_of(rig.left);
  file.right = section_of(rig.right);
  file.T_right_left = rows_of(rig.T_right_left);
  file.T_base_left = rows_of(rig.T_base_left);
  return dump_config(file);
}

}  // namespace sovo
