#include <array>
#include <string>

#include "sovo/driver/sim/world.h"

namespace sovo::sim {
namespace {

CameraModel camera(double f, Distortion distortion, std::array<double, 4> d, double dx, double dy) {
  CameraModel c;
  c.width = 640;
  c.height = 400;
  c.fx = f;
  c.fy = f;
  c.cx = 319.5 + dx;
  c.cy = 199.5 + dy;
  c.distortion = distortion;
  if (distortion != Distortion::kNone) {
    for (std::size_t i = 0; i < d.size(); ++i) c.d[i] = d[i];
    c.num_coefficients = 4;
  }
  return c;
}

}  // namespace

StereoRig own_rig(World world) {
  StereoRig rig;
  rig.name = "sim_" + std::string(name_of(world));
  const auto place_right = [&rig](double baseline, const Vec3& turn) {
    rig.T_right_left = SE3(SO3::exp(turn), Vec3(-baseline, 0.0, 0.0));
  };
  switch (world) {
    case World::kLawn:  // a stereo camera in the hand
      rig.left = camera(350.0, Distortion::kNone, {}, 0.0, 0.0);
      rig.right = camera(352.0, Distortion::kNone, {}, 3.0, -2.0);
      place_right(0.12, {0.004, -0.006, 0.003});
      break;
    case World::kPool:  // wide lenses behind flat glass
      rig.left = camera(300.0, Distortion::kEquidistant, {-0.012, 0.004, -0.003, 0.0006}, 2.0, 1.0);
      rig.right =
          camera(301.0, Distortion::kEquidistant, {-0.010, 0.003, -0.002, 0.0005}, -3.0, 2.0);
      place_right(0.18, {-0.003, 0.005, 0.002});
      break;
    case World::kStreet:
    case World::kHighway:  // rectified, on a car's roof
      rig.left = camera(380.0, Distortion::kNone, {}, 0.0, -20.0);
      rig.right = rig.left;
      place_right(0.5, Vec3::Zero());
      break;
    case World::kHall:  // on a small aircraft
      rig.left = camera(345.0, Distortion::kRadtan, {-0.283, 0.074, 0.0002, 0.00002}, -6.0, 5.0);
      rig.right = camera(344.0, Distortion::kRadtan, {-0.281, 0.073, -0.0001, 0.00003}, 5.0, 8.0);
      place_right(0.11, {0.007, 0.002, -0.004});
      break;
    case World::kSand:  // on a rover's mast
      rig.left = camera(340.0, Distortion::kRadtan, {-0.21, 0.036, 0.0003, -0.0001}, 4.0, -3.0);
      rig.right = camera(341.0, Distortion::kRadtan, {-0.208, 0.035, 0.0001, 0.0002}, -5.0, 2.0);
      place_right(0.16, {-0.002, 0.004, 0.003});
      break;
  }
  return rig;
}

double own_frame_rate(World world) {
  return world == World::kLawn || world == World::kHall ? 20.0 : 10.0;
}

}  // namespace sovo::sim
