#include <filesystem>

#include "sovo/io/calibration_formats.h"
#include "sovo/io/photometric_file.h"
#include "sovo/io/yaml_config.h"

namespace sovo {
namespace {

namespace fs = std::filesystem;

/// Flat glass before a camera, as our file has it.
struct PortSection {
  double distance = -1.0;
  double thickness = 0.0;
  double glass = 1.49;
  std::vector<double> normal;

  template <class Visitor>
  void visit(Visitor& v) {
    v("distance", distance, "from the camera's centre (entrance pupil) to the pane [m]");
    v("thickness", thickness, "of the pane [m]");
    v("glass", glass, "index of refraction of the pane: acrylic 1.49, glass 1.52, sapphire 1.77");
    v("normal", normal, "of the pane, outwards, in the camera's optical frame; empty: [0, 0, 1]");
  }
};

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
  PortSection port;
  bool has_port = false;  ///< Whether there is such a section.

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
    if (has_port) v("port", port, "flat glass between this camera in air and the water");
  }
};

struct CalibrationFile {
  int version = 1;
  std::string name;
  CameraSection left;
  CameraSection right;
  std::vector<double> T_right_left;
  std::vector<double> T_base_left;
  double water = 0.0;

  bool has_water = false;  ///< Whether cameras may look through ports.

  void take_ports() { has_water = left.has_port = right.has_port = true; }

  template <class Visitor>
  void visit(Visitor& v) {
    v("sovo_calibration", version, "version of this format");
    v("name", name, "of the rig");
    if (has_water) v("water", water, "index of refraction outside of the ports; 0: no ports");
    v("left", left, "left camera, raw");
    v("right", right, "right camera, raw");
    v("T_right_left", T_right_left, "rows of [R | t], left optical frame into the right one [m]");
    v("T_base_left", T_base_left,
      "rows of [R | t], left optical frame into the base frame (x forward, y left, z up) [m]");
  }
};

CameraSection section_of(const CameraModel& camera) {
  CameraSection section;
  if (camera.port) {
    const Vec3& n = camera.port->normal;
    section.has_port = true;
    section.port = {
        camera.port->distance, camera.port->thickness, camera.port->glass, {n.x(), n.y(), n.z()}};
  }
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

/// Moves the frames of cameras with ports between the cameras' own centres, of which files tell,
/// and those of their ports: there by `along` = 1, back by -1.
void move_origins(double along, StereoRig* rig) {
  const auto moved = [along](const CameraModel& camera) {
    if (!camera.port) return SE3();
    return SE3(SO3(), along * camera.port->centre * camera.port->normal);
  };
  const SE3 T_before_left = moved(rig->left);
  rig->T_right_left = moved(rig->right).inverse() * rig->T_right_left * T_before_left;
  rig->T_base_left = rig->T_base_left * T_before_left;
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

FlatPort port_of(const PortSection& section, double water, const YamlField& where) {
  FlatPort port;
  port.distance = section.distance;
  port.thickness = section.thickness;
  port.glass = section.glass;
  port.water = water;
  if (!(port.distance >= 0.0 && port.distance <= 0.5)) {
    throw where.error(
        "'port' needs 'distance', from the camera's centre to the pane, of 0 to 0.5 m, because "
        "'water' is given: without a port, leave 'water' away");
  }
  if (!(port.thickness >= 0.0 && port.thickness <= 0.2)) {
    throw where.error("the port's 'thickness' must be 0 to 0.2 m");
  }
  if (!(port.glass >= 1.0 && port.glass <= 2.5)) {
    throw where.error("the port's 'glass', an index of refraction, must be 1 to 2.5");
  }
  if (section.normal.empty()) return port;
  if (section.normal.size() != 3) throw where.error("the port's 'normal' needs three numbers");
  port.normal = Vec3(section.normal[0], section.normal[1], section.normal[2]);
  const double length = port.normal.norm();
  if (!(length > 0.0 && port.normal.z() > 0.9 * length)) {
    throw where.error(
        "the port's 'normal' must point outwards, within 25 degrees of the optical axis");
  }
  port.normal /= length;
  return port;
}

/// Puts the cameras, which were calibrated in air, behind their ports.
void submerge(const CalibrationFile& file, const YamlField& root, StereoRig* rig) {
  if (file.water == 0.0) {
    for (const char* side : {"left", "right"}) {
      if (!root.at(side).has("port")) continue;
      throw root.at(side).error(
          "has a 'port', but the file has no 'water': give the index of refraction outside of the "
          "ports beside left and right, 1.333 or, in the sea, 1.34");
    }
    return;
  }
  if (!(file.water >= 1.0 && file.water <= 1.6)) {
    throw root.at("water").error("the index of refraction outside of the ports must be 1 to 1.6");
  }
  rig->left.port = port_of(file.left.port, file.water, root.at("left"));
  rig->right.port = port_of(file.right.port, file.water, root.at("right"));
  for (const auto& [camera, side] : {std::pair(&rig->left, "left"), {&rig->right, "right"}}) {
    const auto centre = centre_behind_port(*camera);
    if (!centre) throw root.at(side).error("sees hardly anything through its port");
    camera->port->centre = *centre;
  }
  move_origins(1.0, rig);
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
  file.take_ports();
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
  submerge(file, root, &rig);
  return calibration;
}

}  // namespace calibration_formats

std::string format_sovo_calibration(const StereoRig& rig, const PhotometricFiles& files) {
  StereoRig own = rig;  // from the cameras' own centres
  move_origins(-1.0, &own);
  CalibrationFile file;
  file.name = rig.name;
  for (const CameraModel* camera : {&own.left, &own.right}) {
    if (!camera->port) continue;
    file.has_water = true;
    file.water = camera->port->water;
  }
  file.left = section_of(own.left);
  file.right = section_of(own.right);
  file.left.response = files.left_response;
  file.left.vignette = files.left_vignette;
  file.right.response = files.right_response;
  file.right.vignette = files.right_vignette;
  file.T_right_left = rows_of(own.T_right_left);
  file.T_base_left = rows_of(own.T_base_left);
  return dump_config(file);
}

}  // namespace sovo
