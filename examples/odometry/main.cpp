#include <cstdio>

#include "sovo/geometry/stereo_rig.h"

/// Where a point three metres ahead appears in both cameras of a rig.
int main() {
  sovo::StereoRig rig;
  rig.left = {.width = 640, .height = 480, .fx = 400, .fy = 400, .cx = 319.5, .cy = 239.5};
  rig.right = rig.left;
  rig.T_right_left.translation().x() = -0.1;

  const sovo::Vec3 point(0.2, -0.1, 3.0);
  const auto left = rig.left.project(point);
  const auto right = rig.right.project(rig.T_right_left * point);
  if (!left || !right) return 1;
  std::printf("left (%.2f, %.2f), right (%.2f, %.2f), disparity %.2f px\n", left->x(), left->y(),
              right->x(), right->y(), left->x() - right->x());
  return 0;
}
