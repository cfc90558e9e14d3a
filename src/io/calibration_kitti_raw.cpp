#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "sovo/io/calibration_formats.h"
#include "sovo/io/text.h"

namespace sovo::calibration_formats {
namespace {

/// `key: numbers`, a line each. Only what is asked for has to be made of numbers.
class KittiFields {
 public:
  KittiFields(const std::string& text, std::string path) : path_(std::move(path)) {
    int number = 0;
    for (const std::string_view line : split_lines(text)) {
      ++number;
      const std::size_t colon = line.find(':');
      if (colon == std::string_view::npos) continue;
      lines_[std::string(line.substr(0, colon))] = {number, std::string(line.substr(colon + 1))};
    }
  }

  bool has(const std::string& key) const { return lines_.count(key) != 0; }

  std::vector<double> numbers(const std::string& key, std::size_t count) const {
    if (!has(key)) throw FormatError(path_ + ": " + key + " is missing");
    const auto& [number, rest] = lines_.at(key);
    const std::string where = path_ + ":" + std::to_string(number) + ": " + key;
    const auto fields = split(rest, " \t");
    if (fields.size() != count) {
      throw FormatError(where + " has " + std::to_string(fields.size()) + " numbers; " +
                        std::to_string(count) + " are needed");
    }
    std::vector<double> out;
    for (const std::string_view field : fields) {
      const auto value = parse_double(field);
      if (!value) {
        throw FormatError(where + ": number " + std::to_string(out.size() + 1) +
                          " must be a finite number, not '" + excerpt(field) + "'");
      }
      out.push_back(*value);
    }
    return out;
  }

  const std::string& path() const { return path_; }

 private:
  std::string path_;
  std::map<std::string, std::pair<int, std::string>> lines_;
};

void set_size(const KittiFields& file, const std::string& key, CameraModel* camera) {
  constexpr double kLargest = 1e5;
  const std::vector<double> size = file.numbers(key, 2);
  for (const double side : size) {
    if (!(side >= 1.0 && side <= kLargest && side == std::floor(side))) {
      throw FormatError(file.path() + ": " + key + " must be a width and a height in pixels");
    }
  }
  camera->width = static_cast<int>(size[0]);
  camera->height = static_cast<int>(size[1]);
}

/// A camera as its images come from it: K, D (k1 k2 p1 p2 k3), S (width, height).
CameraModel raw_camera(const KittiFields& file, const std::string& number) {
  const std::vector<double> k = file.numbers("K_" + number, 9);
  const std::vector<double> d = file.numbers("D_" + number, 5);
  CameraModel camera;
  set_size(file, "S_" + number, &camera);
  camera.fx = k[0];
  camera.fy = k[4];
  camera.cx = k[2];
  camera.cy = k[5];
  camera.distortion = Distortion::kRadtan;
  camera.num_coefficients = 5;
  std::copy(d.begin(), d.end(), camera.d.begin());
  return camera;
}

/// From camera 0 into this one: R, T.
SE3 motion_from_first(const KittiFields& file, const std::string& number) {
  MatX matrix(3, 4);
  const std::vector<double> r = file.numbers("R_" + number, 9);
  const std::vector<double> t = file.numbers("T_" + number, 3);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      matrix(row, column) = r[static_cast<std::size_t>(3 * row + column)];
    }
    matrix(row, 3) = t[static_cast<std::size_t>(row)];
  }
  return rigid_from_matrix(matrix, file.path() + ": R_" + number + " ");
}

Projection rectified_projection(const KittiFields& file, const std::string& number) {
  const std::vector<double> p = file.numbers("P_rect_" + number, 12);
  return Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(p.data());
}

CameraModel rectified_camera(const KittiFields& file, const std::string& number) {
  const Projection p = rectified_projection(file, number);
  CameraModel camera;
  set_size(file, "S_rect_" + number, &camera);
  camera.fx = p(0, 0);
  camera.fy = p(1, 1);
  camera.cx = p(0, 2);
  camera.cy = p(1, 2);
  return camera;
}

bool is_of_size(const CameraModel& camera, const CalibrationOptions& options) {
  return camera.width == options.image_width && camera.height == options.image_height;
}

std::string size_of(const CameraModel& camera) {
  return std::to_string(camera.width) + "x" + std::to_string(camera.height);
}

}  // namespace

Calibration parse_kitti_raw(const std::string& text, const std::string& path,
                            const CalibrationOptions& options) {
  const KittiFields file(text, path);
  const bool colour = options.kitti_colour.value_or(!file.has("K_00") && !file.has("P_rect_00"));
  const std::string left = colour ? "02" : "00";
  const std::string right = colour ? "03" : "01";
  Calibration calibration;
  calibration.format = "KITTI raw, as the cameras see";
  StereoRig& rig = calibration.rig;
  rig.name = "kitti";
  rig.left = raw_camera(file, left);
  rig.right = raw_camera(file, right);
  rig.T_right_left = motion_from_first(file, right) * motion_from_first(file, left).inverse();
  if (options.image_width == 0 || is_of_size(rig.left, options)) return calibration;
  const CameraModel rectified = rectified_camera(file, left);
  if (!is_of_size(rectified, options)) {
    throw FormatError(path + ": is for images of " + size_of(rig.left) + " as they come, or " +
                      size_of(rectified) + " rectified, not of " +
                      std::to_string(options.image_width) + "x" +
                      std::to_string(options.image_height));
  }
  calibration.format = "KITTI raw, rectified";
  rig.left = rectified;
  rig.right = rectified_camera(file, right);
  rig.T_right_left = SE3(SO3(), translation_of(rectified_projection(file, right)) -
                                    translation_of(rectified_projection(file, left)));
  return calibration;
}

}  // namespace sovo::calibration_formats
