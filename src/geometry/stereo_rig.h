#pragma once

#include <string>

#include "sovo/geometry/camera_model.h"
#include "sovo/geometry/se3.h"

namespace sovo {

/// Rotation from an optical frame (x right, y down, z forward) to a body frame (x forward, y left,
/// z up), as REP-103 defines them.
inline SE3 body_from_optical() {
  Mat3 r;
  r << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return {r, Vec3::Zero()};
}

/// Two cameras, possibly different ones, at a fixed and known relative pose. Nothing is assumed
/// rectified.
struct StereoRig {
  std::string name;
  CameraModel left;
  CameraModel right;
  SE3 T_right_left;  ///< Left optical frame into right optical frame [m].
  /// Left optical frame into the vehicle's base frame (REP-103) [m].
  SE3 T_base_left = body_from_optical();

  /// Distance between the two optical centres [m].
  double baseline() const { return T_right_left.translation().norm(); }

  /// The rig as a right image sees it that was exposed at another instant than the left one:
  /// `T_later_left` maps the left camera at its own instant into where it was at the right one's.
  StereoRig moved(const SE3& T_later_left) const {
    StereoRig out = *this;
    out.T_right_left = T_right_left * T_later_left;
    return out;
  }

  /// The rig with its right camera turned about its own centre, by `turn` in its own frame.
  StereoRig turned(const SO3& turn) const {
    StereoRig out = *this;
    out.T_right_left = SE3(turn, Vec3::Zero()) * T_right_left;
    return out;
  }
};

}  // namespace sovo
