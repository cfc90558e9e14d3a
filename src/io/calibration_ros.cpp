#include <cmath>
#include <filesystem>

#include "sovo/geometry/radtan_fit.h"
#include "sovo/io/calibration_formats.h"
#include "sovo/io/text.h"

namespace sovo {
namespace calibration_formats {
namespace {

/// One camera_info: the raw camera, and how it is rectified.
struct CameraInfo {
  CameraModel camera;
  Mat3 rectification = Mat3::Identity();
  Eigen::Matrix<double, 3, 4> projection;
};

CameraInfo parse_info(const YamlField& root) {
  CameraFields fields;
  fields.width = root.at_any({"image_width", "width"}).whole_number();
  fields.height = root.at_any({"image_height", "height"}).whole_number();
  const MatX k = root.at_any({"camera_matrix", "k", "K"}).matrix(3, 3);
  fields.intrinsics = {k(0, 0), k(1, 1), k(0, 2), k(1, 2)};
  fields.distortion_model = root.at("distortion_model").text();
  fields.coefficients = root.at_any({"distortion_coefficients", "d", "D"}).numbers();
  CameraInfo info;
  info.camera = make_camera(fields, root);
  const YamlField rectification = root.at_any({"rectification_matrix", "r", "R"});
  MatX pose = MatX::Zero(3, 4);
  pose.leftCols(3) = rectification.matrix(3, 3);
  info.rectification = rigid_from_matrix(pose, rectification.error("").what()).rotation_matrix();
  const YamlField projection = root.at_any({"projection_matrix", "p", "P"});
  info.projection = projection.matrix(3, 4);
  if (info.projection(0, 0) == 0.0 || info.projection(1, 1) == 0.0) {
    throw projection.error("has a focal length of 0: the camera is not calibrated");
  }
  return info;
}

/// Path with the last "from" in the file's name replaced; empty when it has none.
std::string replaced(const std::string& path, const std::string& from, const std::string& to) {
  const std::filesystem::path file(path);
  std::string name = file.filename().string();
  const std::size_t at = name.rfind(from);
  if (at == std::string::npos) return {};
  name.replace(at, from.size(), to);
  return (file.parent_path() / name).string();
}

/// Files of the left and right camera, given either one.
std::pair<std::string, std::string> pair_of(const std::string& path,
                                            const CalibrationOptions& options) {
  if (!options.right_path.empty()) return {path, options.right_path};
  if (const std::string right = replaced(path, "left", "right"); !right.empty()) {
    return {path, right};
  }
  if (const std::string left = replaced(path, "right", "left"); !left.empty()) return {left, path};
  throw FormatError(path +
                    ": is one camera's camera_info; name the pair's files alike, with 'left' and "
                    "'right' in their names, or give the right one too");
}

}  // namespace

Calibration parse_ros(const YamlField& root, const CalibrationOptions& options) {
  const auto [left_path, right_path] = pair_of(root.file(), options);
  const YamlField left_root = read_yaml_file(left_path);
  const YamlField right_root = read_yaml_file(right_path);
  const CameraInfo left = parse_info(left_root);
  const CameraInfo right = parse_info(right_root);
  Calibration calibration;
  calibration.format = "ROS camera_info";
  StereoRig& rig = calibration.rig;
  rig.name = left_root.has("camera_name") ? left_root.at("camera_name").text() : "ros";
  if (rig.name.ends_with("_left")) rig.name.resize(rig.name.size() - 5);
  rig.left = left.camera;
  rig.right = right.camera;
  // Both rectified frames are parallel: R_right x_right = R_left x_left + t.
  const Vec3 t = translation_of(right.projection) - translation_of(left.projection);
  const Mat3 r = right.rectification.transpose();
  rig.T_right_left = SE3(Mat3(r * left.rectification), r * t);
  if (t.norm() == 0.0) {
    throw right_root.at_any({"projection_matrix", "p", "P"})
        .error("has no baseline: its fourth number must be -fx * baseline");
  }
  return calibration;
}

}  // namespace calibration_formats

namespace {

/// Rotations of both cameras into the common rectified frame, and its pinhole.
struct Rectification {
  Mat3 left, right;
  double focal = 0.0, cx = 0.0, cy = 0.0;
};

/// Where the camera looks at its image's centre, in the rectified frame's plane z = 1.
Vec2 viewing_centre(const CameraModel& camera, const Mat3& rotation) {
  const Vec2 centre(0.5 * (camera.width - 1), 0.5 * (camera.height - 1));
  const Vec3 bearing = rotation * camera.unproject(centre).value_or(Vec3::UnitZ());
  return bearing.z() > 0.1 ? Vec2(bearing.head<2>() / bearing.z()) : Vec2::Zero();
}

Rectification rectify(const StereoRig& rig) {
  const Vec3 half = 0.5 * rig.T_right_left.rotation().log();
  const SO3 mid_left = SO3::exp(half);
  const SO3 mid_right = SO3::exp(-half);
  const Vec3 baseline = -(mid_right * rig.T_right_left.translation());
  // The longer axis of the rig becomes the row direction; z stays as near as it can.
  Mat3 axes;
  axes.row(0) = baseline.normalized();
  axes.row(1) = Vec3::UnitZ().cross(Vec3(axes.row(0))).normalized();
  axes.row(2) = Vec3(axes.row(0)).cross(Vec3(axes.row(1)));
  Rectification result;
  result.left = axes * mid_left.matrix();
  result.right = axes * mid_right.matrix();
  result.focal = 0.25 * (rig.left.fx + rig.left.fy + rig.right.fx + rig.right.fy);
  const Vec2 centre =
      0.5 * (viewing_centre(rig.left, result.left) + viewing_centre(rig.right, result.right));
  result.cx = 0.5 * (rig.left.width - 1) - result.focal * centre.x();
  result.cy = 0.5 * (rig.left.height - 1) - result.focal * centre.y();
  return result;
}

std::string list(const std::vector<double>& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : ", ") + format_double(value);
  return "[" + text + "]";
}

std::string matrix_text(const std::string& key, const MatX& m) {
  std::vector<double> values;
  for (int i = 0; i < m.rows(); ++i) {
    for (int j = 0; j < m.cols(); ++j) values.push_back(m(i, j));
  }
  return key + ":\n  rows: " + std::to_string(m.rows()) + "\n  cols: " + std::to_string(m.cols()) +
         "\n  data: " + list(values) + "\n";
}

std::string camera_info(const std::string& name, const CameraModel& camera, const Mat3& r,
                        const MatX& p) {
  const bool fisheye = camera.distortion == Distortion::kEquidistant;
  const int count = fisheye ? 4 : camera.num_coefficients == 8 ? 8 : 5;
  MatX d(1, count);
  for (int i = 0; i < count; ++i) d(0, i) = camera.d[static_cast<std::size_t>(i)];
  return "image_width: " + std::to_string(camera.width) +
         "\nimage_height: " + std::to_string(camera.height) + "\ncamera_name: " + name + "\n" +
         matrix_text("camera_matrix", camera.matrix()) + "distortion_model: " +
         (fisheye      ? "equidistant"
          : count == 8 ? "rational_polynomial"
                       : "plumb_bob") +
         "\n" + matrix_text("distortion_coefficients", d) + matrix_text("rectification_matrix", r) +
         matrix_text("projection_matrix", p);
}

}  // namespace

CameraInfoPair format_ros_calibration(const StereoRig& rig) {
  const StereoRig plain = without_ports(rig);
  const Rectification rectified = rectify(plain);
  MatX p(3, 4);
  p << rectified.focal, 0, rectified.cx, 0, 0, rectified.focal, rectified.cy, 0, 0, 0, 1, 0;
  MatX p_right = p;
  p_right(0, 3) = -rectified.focal * plain.baseline();
  const std::string name = rig.name.empty() ? "stereo" : rig.name;
  return {camera_info(name + "_left", plain.left, rectified.left, p),
          camera_info(name + "_right", plain.right, rectified.right, p_right)};
}

}  // namespace sovo
