#include "sovo/image/stereo_rectification.h"

#include <gtest/gtest.h>

#include "support/cameras.h"

namespace sovo {
namespace {

StereoRig test_rig(const Vec3& T_right_left_translation) {
  StereoRig rig;
  rig.left = {752, 480, 458.6, 457.3, 367.2, 248.4, Distortion::kRadtan, {-0.28, 0.07}, 4};
  rig.right = {640, 400, 300.0, 301.0, 320.5, 200.5, Distortion::kEquidistant, {0.01, -0.002}, 4};
  rig.T_right_left = SE3(SO3::exp(Vec3(0.02, -0.03, 0.01)), T_right_left_translation);
  return rig;
}

TEST(StereoRectification, APointLiesInOneRowOfBothImages) {
  const StereoRig rig = test_rig({-0.11, 0.003, 0.002});
  const StereoRectification r = rectify(rig);
  EXPECT_FALSE(r.vertical);
  EXPECT_EQ(r.left.fx, r.right.fx);
  for (const Vec3& point : {Vec3(0.1, 0.2, 2.0), Vec3(-0.5, -0.3, 3.0), Vec3(0.4, 0.0, 1.5)}) {
    const auto left = r.left.project(r.R_left * point);
    const auto right = r.right.project(r.R_right * (rig.T_right_left * point));
    ASSERT_TRUE(left && right);
    EXPECT_NEAR(left->y(), right->y(), 1e-9);
    const double depth = (r.R_left * point).z();
    EXPECT_NEAR((left->x() - r.left.cx) - (right->x() - r.right.cx),
                r.left.fx * rig.baseline() / depth, 1e-9);
  }
}

TEST(StereoRectification, CamerasAboveEachOtherShareColumns) {
  const StereoRig rig = test_rig({0.001, -0.2, 0.003});
  const StereoRectification r = rectify(rig);
  EXPECT_TRUE(r.vertical);
  const Vec3 point(0.2, 0.1, 2.5);
  const auto left = r.left.project(r.R_left * point);
  const auto right = r.right.project(r.R_right * (rig.T_right_left * point));
  ASSERT_TRUE(left && right);
  EXPECT_NEAR(left->x(), right->x(), 1e-9);
  EXPECT_NEAR(r.t_right_left.y(), -rig.baseline(), 1e-12);
}

TEST(RotatedUndistorter, EveryPixelIsThatOfItsRay) {
  const StereoRig rig = test_rig({-0.11, 0.003, 0.002});
  const StereoRectification r = rectify(rig);
  // A ramp to the right with rows of 800 bytes: the value tells where a pixel came from.
  constexpr int kStep = 800;
  std::vector<std::uint8_t> raw(static_cast<std::size_t>(kStep) * rig.left.height, 0);
  for (int y = 0; y < rig.left.height; ++y) {
    for (int x = 0; x < rig.left.width; ++x) {
      raw[static_cast<std::size_t>(y) * kStep + x] = static_cast<std::uint8_t>(x / 3);
    }
  }
  std::vector<std::uint8_t> out;
  RotatedUndistorter(rig.left, r.left, r.R_left).apply(raw, kStep, &out);
  ASSERT_EQ(out.size(), static_cast<std::size_t>(752 * 480));
  for (const auto& [x, y] : {std::pair(376, 240), std::pair(100, 100), std::pair(650, 400)}) {
    const Vec3 ray((x - r.left.cx) / r.left.fx, (y - r.left.cy) / r.left.fy, 1.0);
    const auto source = rig.left.project(r.R_left.transpose() * ray);
    ASSERT_TRUE(source);
    EXPECT_NEAR(out[static_cast<std::size_t>(y) * 752 + x], source->x() / 3.0, 1.0);
  }
}

TEST(RotatedUndistorter, WhereNothingIsSeenItIsBlack) {
  const CameraModel raw = {64, 48, 50.0, 50.0, 31.5, 23.5};
  CameraModel wide = raw;
  wide.fx = wide.fy = 20.0;
  std::vector<std::uint8_t> out;
  const std::vector<std::uint8_t> white(64 * 48, 255);
  RotatedUndistorter(raw, wide, Mat3::Identity()).apply(white, 64, &out);
  EXPECT_EQ(out.front(), 0);
  EXPECT_EQ(out[24 * 64 + 32], 255);
}

}  // namespace
}  // namespace sovo
