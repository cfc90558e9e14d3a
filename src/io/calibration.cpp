#include "sovo/io/calibration.h"

#include <algorithm>
#include <array>
#include <filesystem>

#include "sovo/io/calibration_formats.h"
#include "sovo/io/photometric_file.h"
#include "sovo/io/text.h"
#include "sovo/io/yaml_node.h"

namespace sovo {
namespace {

namespace fs = std::filesystem;
namespace formats = calibration_formats;

/// Files that a folder's calibration may be in, the most specific first.
constexpr std::array kFolderFiles = {"calibration.yaml", "calib.txt",   formats::kKittiRawFile,
                                     "camchain.yaml",    "stereo.yaml", "intrinsics.yml",
                                     "left.yaml",        "sensor.yaml"};

Calibration parse_yaml_calibration(const std::string& path, const CalibrationOptions& options) {
  const YamlField root = formats::read_yaml_file(path);
  if (!root.is_map())
    throw FormatError(path + ": is no calibration: 'key: value' lines are needed");
  if (root.has("sovo_calibration")) {
    return formats::parse_sovo(formats::value_or_throw(read_text_file(path)), path);
  }
  if (root.has("cam0")) return formats::parse_kalibr(root);
  if (root.find_any({"T_BS", "sensor_type"})) {
    return formats::parse_euroc(fs::absolute(path).parent_path().parent_path());
  }
  if (root.find_any({"M1", "K1", "cameraMatrix1"})) return formats::parse_opencv(root, options);
  if (root.find_any({"projection_matrix", "camera_matrix", "p", "P"})) {
    return formats::parse_ros(root, options);
  }
  throw FormatError(path +
                    ": is no calibration that is known: sovo, EuRoC sensor.yaml, Kalibr camchain, "
                    "OpenCV stereo (M1 D1 M2 D2 R T), ROS camera_info or a ZED's SN*.conf");
}

Calibration parse_file(const std::string& path, const CalibrationOptions& options) {
  const std::string text = formats::value_or_throw(read_text_file(path));
  if (trim(text).empty()) throw FormatError(path + ": is empty");
  for (const std::string_view line : split_lines(text)) {
    if (line.starts_with("P0:") || line.starts_with("P2:")) {
      return formats::parse_kitti(text, path, options);
    }
    if (line.starts_with("K_00:") || line.starts_with("K_02:")) {
      return formats::parse_kitti_raw(text, path, options);
    }
    if (line.starts_with("[LEFT_CAM_")) return formats::parse_zed(text, path, options);
  }
  return parse_yaml_calibration(path, options);
}

/// For a drive of KITTI raw, which is given with images as they came or rectified, their size.
CalibrationOptions options_for(const fs::path& folder, CalibrationOptions options) {
  CameraModel camera;
  formats::apply_size_options(options, &camera);
  for (const char* name : {"image_00", "image_02"}) {
    formats::size_from_images(folder / name / "data", &camera);
  }
  options.image_width = camera.width;
  options.image_height = camera.height;
  return options;
}

Calibration parse_folder(const std::string& path, const CalibrationOptions& given) {
  const CalibrationOptions options = options_for(path, given);
  for (const char* name : kFolderFiles) {
    const fs::path file = fs::path(path) / name;
    if (fs::is_regular_file(file)) return parse_file(file, options);
  }
  for (const fs::path& folder : {fs::path(path) / "mav0", fs::path(path)}) {
    if (fs::is_regular_file(folder / "cam0" / "sensor.yaml")) return formats::parse_euroc(folder);
  }
  const fs::path of_the_day =
      (fs::absolute(path) / ".." / formats::kKittiRawFile).lexically_normal();
  const bool drive = fs::is_directory(fs::path(path) / "image_00" / "data") ||
                     fs::is_directory(fs::path(path) / "image_02" / "data");
  if (drive && fs::is_regular_file(of_the_day)) return parse_file(of_the_day, options);
  throw FormatError(
      path +
      ": has no calibration: calibration.yaml (sovo), calib.txt (KITTI), "
      "calib_cam_to_cam.txt (KITTI raw, also beside the drive), mav0/cam0/sensor.yaml (EuRoC), "
      "camchain.yaml (Kalibr), stereo.yaml (OpenCV) "
      "or left.yaml and right.yaml (ROS) are looked for");
}

/// Masks that lie in a dataset's folder.
void add_folder_masks(const std::string& path, Calibration* calibration) {
  const fs::path left = fs::path(path) / "mask_left.png";
  const fs::path right = fs::path(path) / "mask_right.png";
  const StereoRig& rig = calibration->rig;
  if (calibration->left_mask.empty() && fs::exists(left)) {
    calibration->left_mask =
        formats::value_or_throw(read_mask(left, rig.left.width, rig.left.height));
  }
  if (calibration->right_mask.empty() && fs::exists(right)) {
    calibration->right_mask =
        formats::value_or_throw(read_mask(right, rig.right.width, rig.right.height));
  }
}

void refuse_invalid(const std::string& path, const StereoRig& rig) {
  std::string message;
  for (const std::string& problem : check_rig(rig)) {
    message += (message.empty() ? "" : "\n") + path + ": " + problem;
  }
  if (!message.empty()) throw FormatError(message);
}

}  // namespace

Result<Calibration> load_calibration(const std::string& path, const CalibrationOptions& options) {
  try {
    if (!fs::exists(path)) return Error{path + ": there is no such file or folder"};
    const bool folder = fs::is_directory(path);
    Calibration calibration = folder ? parse_folder(path, options) : parse_file(path, options);
    if (folder) add_folder_masks(path, &calibration);
    if (options.validate) refuse_invalid(path, calibration.rig);
    return calibration;
  } catch (const FormatError& error) {
    return Error{error.what()};
  } catch (const YAML::Exception& error) {
    return Error{path + ": is not YAML: " + error.msg};
  } catch (const fs::filesystem_error& error) {
    return Error{path + ": cannot be read: " + error.code().message()};
  }
}

namespace calibration_formats {

YamlField read_yaml_file(const std::string& path) {
  std::string text = value_or_throw(read_text_file(path));
  // OpenCV writes the directive with a colon, which is not YAML; the lines keep their numbers.
  if (text.starts_with("%YAML")) text.insert(0, "#");
  return {path, value_or_throw(parse_yaml(text, path))};
}

}  // namespace calibration_formats
}  // namespace sovo
