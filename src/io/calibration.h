#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sovo/geometry/stereo_rig.h"
#include "sovo/image/image.h"
#include "sovo/image/photometric.h"
#include "sovo/io/result.h"

namespace sovo {

/// All that is known about a pair of cameras.
struct Calibration {
  StereoRig rig;  ///< Raw (distorted) cameras, and their ports.
  PhotometricCalibration left_photometric;
  PhotometricCalibration right_photometric;
  ImageU8 left_mask;  ///< 0 where the image must not be used; empty: all of it is used.
  ImageU8 right_mask;
  std::string format;  ///< Which kind of file it came from, for people.
};

/// What a file may not say about itself.
struct CalibrationOptions {
  /// Image size where the format has none (KITTI, some OpenCV files) [px]; 0: taken from the first
  /// image beside the file when there is one.
  int image_width = 0;
  int image_height = 0;
  /// KITTI: cameras 2 and 3 (colour) rather than 0 and 1 (grey); unset: what the folder has.
  std::optional<bool> kitti_colour;
  /// ROS camera_info: the right camera's file, when it is not named as the left one's with "right"
  /// for "left".
  std::string right_path;
  /// Whether a rig that `check_rig` objects to is refused.
  bool validate = true;
};

/// Reads a calibration, its format recognised by content: sovo, KITTI calib.txt and
/// calib_cam_to_cam.txt, EuRoC sensor.yaml pair, Kalibr camchain, OpenCV stereo FileStorage, ROS
/// camera_info pair, a ZED's SN*.conf (with the image size of one eye in the options). `path` is
/// the file or a folder that has it (a dataset's folder; of a drive of KITTI raw, the
/// folder above may have it). A folder's `mask_left.png` and
/// `mask_right.png` and, in EuRoC's layout, DSO's `dso/cam{0,1}/{pcalib.txt,vignette.png}` are read
/// too. The error says which file, line and field, and why.
Result<Calibration> load_calibration(const std::string& path,
                                     const CalibrationOptions& options = {});

/// Everything about the rig that cannot be right, each a sentence that says what to do: sizes,
/// focal lengths, principal points, values that are not finite, the baseline's unit and sign.
std::vector<std::string> check_rig(const StereoRig& rig);

/// Names of the files beside our own YAML, or empty.
struct PhotometricFiles {
  std::string left_response, left_vignette;
  std::string right_response, right_vignette;
};

/// The rig as our own YAML.
std::string format_sovo_calibration(const StereoRig& rig, const PhotometricFiles& files = {});

/// Texts of the two ROS camera_info files.
struct CameraInfoPair {
  std::string left;
  std::string right;
};

/// The rig as a pair of ROS camera_info files, with a rectification that has equal rows in both
/// images and infinity at equal columns: half of the relative rotation each, the x axis along the
/// baseline.
CameraInfoPair format_ros_calibration(const StereoRig& rig);

}  // namespace sovo
