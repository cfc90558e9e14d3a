#pragma once

#include <optional>

#include "sovo/geometry/types.h"

namespace sovo {

/// A pane between a camera in air and the water that it looks into. Light is refracted at both
/// faces, so that an angle is smaller in water than in the camera, and rays in water do not meet in
/// one point: each passes the normal through the camera at a place of its own (an axial camera;
/// Agrawal, Ramalingam, Taguchi, Chari, "A theory of multi-layer flat refractive geometry", 2012).
struct FlatPort {
  double distance = 0.0;       ///< From the camera's centre (its entrance pupil) to the pane [m].
  double thickness = 0.0;      ///< Of the pane [m].
  double glass = 1.49;         ///< Index of refraction of the pane; 1.49 is acrylic.
  double water = 1.333;        ///< Index of refraction of what is outside.
  Vec3 normal{0.0, 0.0, 1.0};  ///< Unit normal of the pane in the camera's axes, outwards.
  /// What stands for a centre of the rays in water, along the normal from the camera's own [m].
  double centre = 0.0;

  /// Whether there may be such a port: finite numbers, 0.5 m and 0.2 m at most from the camera and
  /// through the pane, indices of 1 to 2.5 and 1 to 1.6, a unit normal within 25 degrees of the
  /// optical axis.
  bool is_possible() const;

  /// Direction in air of a direction in water, of any length. `jacobian`: d air / d water, may be
  /// null. Nothing where no light comes from: more than some 48 degrees off the normal.
  std::optional<Vec3> to_air(const Vec3& direction, Mat3* jacobian = nullptr) const;

  /// Unit direction in water of a unit direction in air; nothing along or behind the pane.
  std::optional<Vec3> to_water(const Vec3& bearing) const;

  /// Where the ray of a direction in water, of any length, passes the normal, from `centre` [m].
  double offset(const Vec3& direction) const;
};

}  // namespace sovo
