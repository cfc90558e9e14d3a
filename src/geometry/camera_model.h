#pragma once

#include <array>
#include <optional>
#include <string>

#include "sovo/geometry/flat_port.h"
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

/// A camera: pinhole with optional distortion, perhaps behind a flat port. Pixel centres are at
/// integers, so the image covers [-0.5, width - 0.5] x [-0.5, height - 0.5]. Camera frame: x right,
/// y down, z forward; its origin is the camera's centre or, with a port, that of the port.
///
/// Through a port rays do not meet in the origin. What is projected and unprojected are then
/// directions of rays, and `ray_offset` tells how far beside the origin they pass.
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
  /// In front of the camera; what else is said of that is of air.
  std::optional<FlatPort> port = std::nullopt;
  /// Of an image that was resampled by the directions of its rays in water: the port no longer
  /// bends them, but they pass the origin as they did.
  bool straightened = false;

  /// Whether directions are those of a pinhole.
  bool is_pinhole() const { return distortion == Distortion::kNone && (!port || straightened); }

  /// Place that the ray of a direction passes, from the origin [m]; zero without a port.
  Vec3 ray_offset(const Vec3& direction) const {
    return port ? Vec3(port->offset(direction) * port->normal) : Vec3::Zero();
  }

  /// Direction of the ray that meets a point of the camera frame [m], of about the point's length;
  /// without a port the point itself.
  Vec3 direction_of(const Vec3& point) const;

  /// Pixel of a direction in the camera frame; nothing when it is not in front of a pinhole
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

 private:
  std::optional<Vec2> project_in_air(const Vec3& p, Mat23* jacobian) const;
  std::optional<Vec3> unproject_in_air(const Vec2& pixel) const;
};

/// Where on the normal of its port, from its own centre, rays of a camera pass in the mean of its
/// image: FlatPort::centre [m]. Nothing where it sees hardly anything through the port.
std::optional<double> centre_behind_port(const CameraModel& camera);

}  // namespace sovo
