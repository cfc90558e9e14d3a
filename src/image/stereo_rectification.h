#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sovo/geometry/stereo_rig.h"

namespace sovo {

/// Two virtual pinhole cameras, side by side, that look the same way: corresponding points lie in
/// one row (in one column when the cameras of the rig lie above each other). For other programs'
/// stereo matching; the odometry needs none.
struct StereoRectification {
  Mat3 R_left;            ///< Left optical frame into the rectified frame.
  Mat3 R_right;           ///< Right optical frame into the rectified frame.
  CameraModel left;       ///< Of the size of the left image, without distortion.
  CameraModel right;      ///< Of the size of the right image; focal length as `left`.
  Vec3 t_right_left;      ///< Left rectified frame into the right one: (-baseline, 0, 0) [m].
  bool vertical = false;  ///< The baseline runs along y: t_right_left = (0, -baseline, 0).
};

/// The rectification with the longest views that stay inside the raw images along their middle
/// rows and columns, at most 100 degrees wide. Precondition: the baseline is not zero.
StereoRectification rectify(const StereoRig& rig);

/// Resamples 8-bit images of a raw camera as a rotated pinhole would see them.
class RotatedUndistorter {
 public:
  /// `R_rectified_raw`: optical frame of `raw` into that of `rectified`.
  RotatedUndistorter(const CameraModel& raw, const CameraModel& rectified,
                     const Mat3& R_rectified_raw);

  /// Bilinear; `raw` has the raw camera's size, rows `step` bytes apart. The result is tightly
  /// packed; pixels that see nothing of the raw image are 0.
  void apply(std::span<const std::uint8_t> raw, int step, std::vector<std::uint8_t>* out) const;

 private:
  /// Bilinear interpolation from four pixels, weights in 1/128.
  struct Tap {
    std::int16_t x = -1;  ///< Negative: no source.
    std::int16_t y = -1;
    std::uint8_t fx = 0;
    std::uint8_t fy = 0;
  };

  std::vector<Tap> taps_;
};

}  // namespace sovo
