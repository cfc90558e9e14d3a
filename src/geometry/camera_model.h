#pragma once

#include <array>
#include <optional>
#include <string>

#include "sovo/geometry/types.h"

namespace sovo {

/// Lens distortion applied to the normalized image plane before the pinhole matrix.
enum class Distortion {
  kNone,
  kRadtan,       ///< Brown-Conrady: k1 k2 p1 p2 [k3 [k4 k5 k6]] in OpenCV's order.
  kEquidistant,  ///< Kannala-Brandt fisheye: k1 k2 k3 k4 on the angle to the optical axis.
};

/// Name as calibration files write it: "none", "radtan", "equidistant".
std::string to_string(Distortion distortion);

/// A central camera: pinhole with optional distortion. Pixel centres are at integers, so the
/// image covers [-0.5, width - 0.5] x [-0.5, height - 0.5]. Camera frame: x right, y down,
/// z forward.
struct CameraModel {
  int width = 0;    ///< [px]
  int height = 0;   ///< [px]
  double fx = 0.0;  ///< [px]
  double fy = 0.0;  ///< [px]
  double cx = 0.0;  ///< [px]
  double cy = 0.0;  ///< [px]
  Distortion distortion = Distortion::kNone;
  std::array<double, 8> d{};  ///< Coefficients in the order of `Distortion`; unused ones are zero.
  int num_coefficients = 0;   ///< How many of `d` the calibration gave: 0, 4, 5 or 8.

  /// Pixel of a point of the camera frame; nothing when the point is not in front of a pinhole
  /// camera, or lies where the distortion polynomial has folded back. The pixel may lie outside
  /// the image.
  std::optional<Vec2> project(const Vec3& point) const;

  /// As above, with the Jacobian d pixel / d point (2x3) [px/m].
  std::optional<Vec2> project(const Vec3& point, Mat23* jacobian) const;

  /// Unit bearing of a pixel (inverse of `project` up to length); nothing where the distortion
  /// cannot be inverted.
  std::optional<Vec3> unproject(const Vec2& pixel) const;

  /// Whether a pixel lies inside the image by at least `border` pixels.
  bool contains(const Vec2& pixel, double border = 0.0) const {
    return pixel.x() >= border && pixel.y() >= border && pixel.x() <= width - 1 - border &&
           pixel.y() <= height - 1 - border;
  }

  /// The same camera with its image reduced by the whole number `factor` (means of blocks;
  /// remainders at the right and lower edge are cut): c' = (c + 1/2) / factor - 1/2.
  CameraModel downscaled(int factor) const;

  /// The camera of pyramid level `level` (level 0 is this).
  CameraModel at_level(int level) const { return downscaled(1 << level); }

  Mat3 matrix() const;
};

}  // namespace sovo
