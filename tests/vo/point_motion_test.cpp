#include "sovo/vo/point_motion.h"

#include <gtest/gtest.h>

#include <vector>

#include "support/cameras.h"

namespace sovo {
namespace {

constexpr double kUnclipped = 1e9;

/// Points in a row across the image, of these inverse depths.
ReferenceLevel points_of(const std::vector<float>& rho) {
  ReferenceLevel level;
  level.camera = test::make_camera(640, 480, 400.0, 400.0, 319.5, 239.5);
  for (std::size_t i = 0; i < rho.size(); ++i) {
    level.u.push_back(100.0F + 4.0F * static_cast<float>(i));
    level.v.push_back(200.0F);
    level.rho.push_back(rho[i]);
  }
  return level;
}

TEST(MotionOfPoints, IsThatOfAKnownMotion) {
  const ReferenceLevel points = points_of(std::vector<float>(100, 0.25F));
  const PointMotion aside = motion_of_points(points, SE3(SO3(), Vec3(0.1, 0, 0)), kUnclipped);
  const double flow = 400.0 * 0.1 * 0.25;
  EXPECT_NEAR(aside.flow_translation, flow, 1e-6);
  EXPECT_NEAR(aside.flow_total, flow, 1e-6);
  EXPECT_NEAR(aside.approach, 0.0, 1e-12);
  const PointMotion turn =
      motion_of_points(points, SE3(SO3::exp(Vec3(0, 0, 0.1)), Vec3::Zero()), kUnclipped);
  EXPECT_NEAR(turn.flow_translation, 0.0, 1e-9);
  EXPECT_GT(turn.flow_total, 2.0);
  EXPECT_NEAR(turn.approach, 0.0, 1e-12);
  for (const double z : {-0.2, 0.2}) {
    EXPECT_NEAR(motion_of_points(points, SE3(SO3(), Vec3(0, 0, z)), kUnclipped).approach, 0.05,
                1e-9);
  }
}

TEST(MotionOfPoints, NearPointsDoNotStandForTheOthers) {
  // One in a hundred is so near that it moves by 400 px, the others by 4.
  std::vector<float> rho(100, 0.1F);
  rho[50] = 10.0F;
  const SE3 aside(SO3(), Vec3(0.1, 0, 0));
  EXPECT_NEAR(motion_of_points(points_of(rho), aside, kUnclipped).flow_total, 40.2, 0.1);
  const PointMotion clipped = motion_of_points(points_of(rho), aside, 20.0);
  EXPECT_NEAR(clipped.flow_total, 4.455, 1e-3);  // the root of 0.99 * 4^2 + 0.01 * 20^2
  EXPECT_NEAR(clipped.flow_translation, 4.455, 1e-3);
}

TEST(MotionOfPoints, TheFewNearPointsOfAnOpenRoadCountMore) {
  // One in ten is near; all the others hardly move.
  std::vector<float> rho(100, 0.01F);
  for (std::size_t i = 0; i < rho.size(); i += 10) rho[i] = 0.06F;
  const SE3 ahead(SO3(), Vec3(0, 0, -2.0));
  // 2 m times three quarters of the mean of rho squared over that of rho; a mean of all has 0.03.
  EXPECT_NEAR(motion_of_points(points_of(rho), ahead, kUnclipped).approach, 0.045, 1e-6);
}

TEST(MotionOfPoints, OnePointThatIsAlmostTouchedDoesNotStandForAllOthers) {
  std::vector<float> rho(100, 0.1F);
  rho[50] = 10.0F;
  const SE3 ahead(SO3(), Vec3(0, 0, -0.1));
  // It weighs as much as eight others, not as a hundred.
  const double of_it = 4.0 * 0.199;
  EXPECT_NEAR(motion_of_points(points_of(rho), ahead, kUnclipped).approach,
              0.75 * (9.9 * 0.01 + of_it * 1.0) / (9.9 + of_it), 1e-6);
}

TEST(MotionOfPoints, ATurnCountsInFullWhateverIsClipped) {
  const ReferenceLevel points = points_of(std::vector<float>(100, 0.25F));
  const SE3 turn(SO3::exp(Vec3(0, 0.3, 0)), Vec3::Zero());
  const double whole = motion_of_points(points, turn, kUnclipped).flow_total;
  EXPECT_GT(whole, 100.0);
  EXPECT_NEAR(motion_of_points(points, turn, 20.0).flow_total, whole, 1e-6);
}

}  // namespace
}  // namespace sovo
