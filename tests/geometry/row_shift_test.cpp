#include "sovo/geometry/row_shift.h"

#include <gtest/gtest.h>

#include "support/numeric.h"

namespace sovo {
namespace {

constexpr double kSeconds = 4e-5;  // from row to row
constexpr double kMiddle = 199.5;

/// log(T_later_earlier) a second of a camera.
Vec6 rate_of(const Vec3& way, const Vec3& turn) {
  Vec6 rate;
  rate << way, turn;
  return rate;
}

RowShift shift_of(const Vec6& rate) {
  return {.per_row = kSeconds * rate.head<3>(), .middle = kMiddle};
}

/// Where a point of the camera at the image's instant is seen in a row, the turning undone.
Vec3 seen(const Vec6& rate, double row, const Vec3& point) {
  const Vec6 moved = (row - kMiddle) * kSeconds * rate;
  const SE3 T_row_instant = SE3::exp(moved);
  return SO3::exp(moved.tail<3>()).inverse() * (T_row_instant * point);
}

class RowShiftTest : public testing::Test {
 protected:
  const Vec6 host_rate_ = rate_of({-0.4, 0.2, -4.0}, {0.1, 0.5, -0.2});
  const Vec6 target_rate_ = rate_of({-0.7, 0.1, -3.8}, {-0.2, 0.6, 0.1});
  const SE3 T_target_host_{SO3::exp(Vec3(0.02, 0.06, -0.03)), Vec3(-0.1, 0.03, -0.6)};
  const PairRowShift shift_{T_target_host_, shift_of(host_rate_), shift_of(target_rate_)};
};

TEST_F(RowShiftTest, BringsAPointWhereTheTargetsRowShowsIt) {
  for (const double host_row : {10.0, 180.0, 390.0}) {
    for (const double target_row : {5.0, 220.0, 395.0}) {
      const Vec3 point(0.4, -0.3, 3.0);  // in the host at its instant
      const Vec3 in_host = seen(host_rate_, host_row, point);
      const Vec3 in_target = seen(target_rate_, target_row, T_target_host_ * point);
      const double rho = 1.0 / in_host.z();
      const auto moved = shift_.at(static_cast<float>(host_row), static_cast<float>(target_row));
      const Eigen::Vector3f t = T_target_host_.translation().cast<float>();
      const Vec3 found =
          T_target_host_.rotation() * (rho * in_host) + rho * moved.applied(t).cast<double>();
      // What is left is of second order; the shift itself is 30 mm and more.
      EXPECT_LT((found.hnormalized() - in_target.hnormalized()).norm(), 1e-4);
      const Vec3 ignorant = T_target_host_ * in_host;
      if (host_row != 180.0 && std::abs(host_row - target_row) > 100.0) {
        EXPECT_GT((ignorant.hnormalized() - in_target.hnormalized()).norm(), 5e-4);
      }
    }
  }
}

TEST_F(RowShiftTest, GrowsWithTheMap) {
  const auto moved = shift_.at(380.0F, 20.0F);
  const Eigen::Vector3f t = T_target_host_.translation().cast<float>();
  EXPECT_LT((moved.applied(1.7F * t) - 1.7F * moved.applied(t)).norm(), 1e-6F);
}

TEST_F(RowShiftTest, ChainAgreesWithCentralDifferences) {
  const auto moved = shift_.at(380.0F, 20.0F);
  const Vec3 d(120.0, -30.0, 45.0);
  const auto f = [&](const Vec3& t) {
    return Eigen::Matrix<double, 1, 1>(d.dot(moved.applied(t.cast<float>()).cast<double>()));
  };
  const Vec3 t = T_target_host_.translation();
  const Vec3 numeric = test::central_differences<1, 3>(f, t, 1e-2).transpose();
  const Vec3 analytic = moved.chain(d.cast<float>()).cast<double>();
  EXPECT_LT((analytic - numeric).norm(), 1e-3 * numeric.norm());
}

TEST(PairRowShift, IsNoneWithoutARollingShutter) {
  EXPECT_TRUE(PairRowShift().none());
  EXPECT_TRUE(PairRowShift(SE3(SO3(), Vec3(1, 0, 0)), {}, {}).none());
}

TEST(PairRowShift, OfAWayShorterThanItselfIsFixed) {
  const RowShift rows{.per_row = Vec3(0, 0, -1e-3), .middle = kMiddle};
  const PairRowShift shift(SE3(SO3(), Vec3(0, 0, -0.01)), {}, rows);
  const auto moved = shift.at(0.0F, 299.5F);
  EXPECT_EQ(moved.share, 0.0F);
  EXPECT_NEAR(moved.applied(Eigen::Vector3f::Zero()).z(), -0.1F, 1e-6F);
}

}  // namespace
}  // namespace sovo
