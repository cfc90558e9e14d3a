#pragma once

#include "support/cameras.h"

namespace sovo::sim {

/// Two small cameras that look into different directions, on a vehicle with lamps or a shadow.
inline StereoRig vehicle_rig() {
  StereoRig rig;
  rig.left = test::make_camera(160, 112, 95, 95, 79.5, 55.5);
  rig.right = test::make_camera(160, 112, 96, 95, 81, 54);
  rig.T_right_left = SE3(SO3::exp({0.006, -0.3, 0.004}), Vec3(-0.2, 0.002, 0.003));
  return rig;
}

}  // namespace sovo::sim
