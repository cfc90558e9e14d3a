#include <algorithm>
#include <filesystem>
#include <map>

#include "sovo/io/calibration_formats.h"
#include "sovo/io/image_file.h"
#include "sovo/io/text.h"

namespace sovo::calibration_formats {
namespace {

namespace fs = std::filesystem;
/// The projection matrices P0..P3 that the file has.
std::map<int, Projection> parse_projections(const std::string& text, const std::string& path) {
  std::map<int, Projection> projections;
  int number = 0;
  for (const std::string_view line : split_lines(text)) {
    ++number;
    if (line.size() < 3 || line[0] != 'P' || line[1] < '0' || line[1] > '3' || line[2] != ':') {
      continue;
    }
    const std::string where =
        path + ":" + std::to_string(number) + ": " + std::string(line.substr(0, 2));
    const auto fields = split(line.substr(3), " \t");
    if (fields.size() != 12) {
      throw FormatError(where + " has " + std::to_string(fields.size()) +
                        " numbers; 12 are needed");
    }
    Projection p;
    for (std::size_t i = 0; i < 12; ++i) {
      const auto value = parse_double(fields[i]);
      if (!value) {
        throw FormatError(where + ": number " + std::to_string(i + 1) +
                          " must be a finite number, not '" + excerpt(fields[i]) + "'");
      }
      p(static_cast<int>(i / 4), static_cast<int>(i % 4)) = *value;
    }
    if (p(0, 0) == 0.0 || p(1, 1) == 0.0 || p(0, 1) != 0.0 || p(1, 0) != 0.0 ||
        p.block<1, 3>(2, 0) != Eigen::RowVector3d(0, 0, 1)) {
      throw FormatError(where + " is not of the form K [I | t] that rectified cameras have");
    }
    projections[line[1] - '0'] = p;
  }
  return projections;
}

CameraModel camera_of(const Projection& p) {
  CameraModel camera;
  camera.fx = p(0, 0);
  camera.fy = p(1, 1);
  camera.cx = p(0, 2);
  camera.cy = p(1, 2);
  return camera;
}

}  // namespace

void size_from_images(const fs::path& folder, CameraModel* camera) {
  if (camera->width > 0 || !fs::is_directory(folder)) return;
  fs::path first;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.is_regular_file() && (first.empty() || entry.path() < first)) first = entry.path();
  }
  if (first.empty()) return;
  const auto image = value_or_throw(read_grey_image(first));
  camera->width = image.width;
  camera->height = image.height;
}

Calibration parse_kitti(const std::string& text, const std::string& path,
                        const CalibrationOptions& options) {
  const auto projections = parse_projections(text, path);
  const fs::path folder = fs::absolute(path).parent_path();
  const bool colour =
      options.kitti_colour.value_or(projections.count(0) == 0 || (!fs::exists(folder / "image_0") &&
                                                                  fs::exists(folder / "image_2")));
  const int left = colour ? 2 : 0;
  for (const int camera : {left, left + 1}) {
    if (projections.count(camera) == 0) {
      throw FormatError(path + ": P" + std::to_string(camera) + " is missing");
    }
  }
  Calibration calibration;
  calibration.format = "KITTI";
  StereoRig& rig = calibration.rig;
  rig.name = "kitti";
  rig.left = camera_of(projections.at(left));
  rig.right = camera_of(projections.at(left + 1));
  rig.T_right_left =
      SE3(SO3(), translation_of(projections.at(left + 1)) - translation_of(projections.at(left)));
  apply_size_options(options, &rig.left);
  apply_size_options(options, &rig.right);
  size_from_images(folder / ("image_" + std::to_string(left)), &rig.left);
  size_from_images(folder / ("image_" + std::to_string(left + 1)), &rig.right);
  return calibration;
}

}  // namespace sovo::calibration_formats
