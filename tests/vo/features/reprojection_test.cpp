#include "sovo/vo/features/reprojection.h"

#include <gtest/gtest.h>

#include "vo/features/feature_test_support.h"

namespace sovo {
namespace {

using namespace test;

class ReprojectionAt : public ::testing::TestWithParam<double> {
 protected:
  CameraModel camera_ = feature_camera();
  SE3 T_target_ = feature_pose(5);
  SE3 T_host_ = feature_pose(2);
  Vec3 ray_ = ray_of(camera_, 211.0, 307.0);

  Vec2 pixel(const SE3& T_target, const SE3& T_host, double rho) const {
    Vec2 out;
    EXPECT_TRUE(reproject(camera_, T_target * T_host.inverse(), ray_, rho, &out));
    return out;
  }
};

TEST_P(ReprojectionAt, JacobiansAreCentralDifferences) {
  const double rho = GetParam();
  Reprojection at;
  ASSERT_TRUE(reproject(camera_, T_target_ * T_host_.inverse(), ray_, rho, &at));
  constexpr double kStep = 1e-6;
  for (int k = 0; k < 6; ++k) {
    Vec6 x = Vec6::Zero();
    x[k] = kStep;
    const SE3 plus = SE3::exp(x);
    const SE3 minus = SE3::exp(-x);
    const Vec2 by_target =
        (pixel(plus * T_target_, T_host_, rho) - pixel(minus * T_target_, T_host_, rho)) /
        (2.0 * kStep);
    const Vec2 by_host =
        (pixel(T_target_, plus * T_host_, rho) - pixel(T_target_, minus * T_host_, rho)) /
        (2.0 * kStep);
    EXPECT_LT((at.d_target.col(k) - by_target).norm(), 1e-5 * (1.0 + by_target.norm())) << k;
    EXPECT_LT((at.d_host.col(k) - by_host).norm(), 1e-5 * (1.0 + by_host.norm())) << k;
  }
  const Vec2 by_rho =
      (pixel(T_target_, T_host_, rho + kStep) - pixel(T_target_, T_host_, rho - kStep)) /
      (2.0 * kStep);
  EXPECT_LT((at.d_rho - by_rho).norm(), 1e-5 * (1.0 + by_rho.norm()));
}

// The last one is infinitely far away.
INSTANTIATE_TEST_SUITE_P(InverseDepths, ReprojectionAt, ::testing::Values(0.8, 0.1, 0.01, 0.0));

TEST_F(ReprojectionAt, ItsDepthIsThatOfThePoint) {
  const double rho = 0.3;
  Reprojection at;
  const SE3 T = T_target_ * T_host_.inverse();
  ASSERT_TRUE(reproject(camera_, T, ray_, rho, &at));
  const Vec3 point = T * Vec3(ray_ / rho);
  EXPECT_NEAR(rho * at.depth_ratio, 1.0 / point.z(), 1e-12);
  EXPECT_LT((at.pixel - *camera_.project(point)).norm(), 1e-9);
}

TEST_F(ReprojectionAt, RowsOfARollingShutterShowItAtTheirOwnInstants) {
  // A camera that comes forward by 0.6 mm a row and to the side.
  const ViewShift rows{.per_row = Vec3(3e-4, -2e-4, -6e-4), .middle = 239.5};
  const Vec2 instant(211.0, 437.0);
  const double rho = 0.4;
  double rho_seen = rho;
  const Vec2 seen = seen_by_shift(camera_, rows, instant, &rho_seen);
  const Vec3 point =
      ray_of(camera_, instant.x(), instant.y()) / rho + rows.at(instant.x(), instant.y());
  EXPECT_LT((seen - *camera_.project(point)).norm(), 1e-9);
  EXPECT_NEAR(rho_seen, 1.0 / point.z(), 1e-12);
  EXPECT_GT((seen - instant).norm(), 1.0);
  // Back again: the row is now the one in which it is seen, a pixel or two on.
  double back = rho_seen;
  const Vec3 ray = ray_at_instant(camera_, rows, seen.x(), seen.y(), &back);
  EXPECT_LT((*camera_.project(ray) - instant).norm(), 0.03 * (seen - instant).norm());
  EXPECT_NEAR(back, rho, 0.001 * rho);
  double same = rho;
  EXPECT_EQ(seen_by_shift(camera_, {}, instant, &same), instant);
  EXPECT_EQ(same, rho);
}

TEST_F(ReprojectionAt, BehindTheCameraNothingIsSeen) {
  Reprojection at;
  Vec2 pixel;
  const SE3 past(SO3(), Vec3(0, 0, -5.0));
  EXPECT_FALSE(reproject(camera_, past, ray_, 0.3, &at));
  EXPECT_FALSE(reproject(camera_, past, ray_, 0.3, &pixel));
}

TEST_F(ReprojectionAt, SurroundingsAreMappedAsNeighboursOfTheSameDepth) {
  const double rho = 0.25;
  const SE3 T = T_target_ * T_host_.inverse();
  const auto seen = [&](double u, double v) {
    Vec2 out;
    EXPECT_TRUE(reproject(camera_, T, ray_of(camera_, u, v), rho, &out));
    return out;
  };
  constexpr double kStep = 1e-4;
  Mat2 numeric;
  numeric << (seen(211.0 + kStep, 307.0) - seen(211.0 - kStep, 307.0)) / (2.0 * kStep),
      (seen(211.0, 307.0 + kStep) - seen(211.0, 307.0 - kStep)) / (2.0 * kStep);
  EXPECT_LT((surroundings(camera_, T, ray_, rho) - numeric).norm(), 1e-6);
}

}  // namespace
}  // namespace sovo
