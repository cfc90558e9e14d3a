#include "sovo/geometry/stereo_rig.h"

#include <gtest/gtest.h>

namespace sovo {
namespace {

TEST(StereoRig, ATurnedRightCameraStaysWhereItIs) {
  StereoRig rig;
  rig.T_right_left = SE3(SO3::exp(Vec3(0.02, -0.01, 0.03)), Vec3(-0.11, 0.004, 0.002));
  const SO3 turn = SO3::exp(Vec3(0.05, -0.2, 0.1));
  const StereoRig turned = rig.turned(turn);
  const Vec3 centre = rig.T_right_left.inverse().translation();
  EXPECT_LT((turned.T_right_left.inverse().translation() - centre).norm(), 1e-15);
  const Vec3 point(0.3, -0.2, 2.0);
  EXPECT_LT((turned.T_right_left * point - turn * (rig.T_right_left * point)).norm(), 1e-15);
  EXPECT_DOUBLE_EQ(turned.baseline(), rig.baseline());
}

}  // namespace
}  // namespace sovo
