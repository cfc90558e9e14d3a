#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "sovo/io/calibration.h"
#include "sovo/io/yaml_field.h"

/// The readers behind `load_calibration`, which catches the `FormatError` that they throw.
namespace sovo::calibration_formats {

/// Intrinsics as every YAML format has them in one way or another.
struct CameraFields {
  int width = 0;
  int height = 0;
  std::vector<double> intrinsics;  ///< fx fy cx cy
  std::string distortion_model;
  std::vector<double> coefficients;
};

/// A camera from its fields; `where` names them in messages. Coefficients that are all zero are no
/// distortion, except a fisheye's.
CameraModel make_camera(const CameraFields& fields, const YamlField& where);

/// A rigid motion from a 3x4 or 4x4 matrix (last row 0 0 0 1); refuses what is not a rotation.
SE3 rigid_from_matrix(const MatX& matrix, const std::string& where);

using Projection = Eigen::Matrix<double, 3, 4>;

/// t of P = K [I | t]: the reference camera's points in this camera's frame [m].
Vec3 translation_of(const Projection& p);

/// The image size of the options; zero when they have none.
void apply_size_options(const CalibrationOptions& options, CameraModel* camera);

/// The image size by the first image of a folder, unless it is known already.
void size_from_images(const std::filesystem::path& folder, CameraModel* camera);

/// Beside the drives of a day of KITTI raw.
inline constexpr const char* kKittiRawFile = "calib_cam_to_cam.txt";

Calibration parse_sovo(const std::string& text, const std::string& path);
Calibration parse_kitti(const std::string& text, const std::string& path,
                        const CalibrationOptions& options);
/// KITTI raw's calib_cam_to_cam.txt: for images as they come (drive_*_extract), or for rectified
/// ones (drive_*_sync) where the options have their size.
Calibration parse_kitti_raw(const std::string& text, const std::string& path,
                            const CalibrationOptions& options);
Calibration parse_euroc(const std::string& mav_folder);
Calibration parse_kalibr(const YamlField& root);
Calibration parse_opencv(const YamlField& root, const CalibrationOptions& options);
Calibration parse_ros(const YamlField& root, const CalibrationOptions& options);
/// Stereolabs' SN*.conf: all resolutions in one file, the options say which.
Calibration parse_zed(const std::string& text, const std::string& path,
                      const CalibrationOptions& options);

/// Reads a YAML file; OpenCV's FileStorage header is skipped.
YamlField read_yaml_file(const std::string& path);

/// Value of a result, or its error thrown as `FormatError`.
template <class T>
T value_or_throw(Result<T> result) {
  if (!result) throw FormatError(result.error());
  return std::move(*result);
}

}  // namespace sovo::calibration_formats
