#include "sovo/geometry/view_shift.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/cameras.h"
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

ViewShift shift_of(const Vec6& rate) {
  return {.per_row = kSeconds * rate.head<3>(), .middle = kMiddle};
}

/// Where a point of the camera at the image's instant is seen in a row, the turning undone.
Vec3 seen(const Vec6& rate, double row, const Vec3& point) {
  const Vec6 moved = (row - kMiddle) * kSeconds * rate;
  const SE3 T_row_instant = SE3::exp(moved);
  return SO3::exp(moved.tail<3>()).inverse() * (T_row_instant * point);
}

class ViewShiftTest : public testing::Test {
 protected:
  const Vec6 host_rate_ = rate_of({-0.4, 0.2, -4.0}, {0.1, 0.5, -0.2});
  const Vec6 target_rate_ = rate_of({-0.7, 0.1, -3.8}, {-0.2, 0.6, 0.1});
  const SE3 T_target_host_{SO3::exp(Vec3(0.02, 0.06, -0.03)), Vec3(-0.1, 0.03, -0.6)};
  const PairViewShift shift_{T_target_host_, shift_of(host_rate_), shift_of(target_rate_)};

  PairViewShift::Displacement at(double host_row, double target_row) const {
    return shift_.at({10.0F, static_cast<float>(host_row)},
                     Eigen::Vector2f(20.0F, static_cast<float>(target_row)));
  }
};

TEST_F(ViewShiftTest, BringsAPointWhereTheTargetsRowShowsIt) {
  for (const double host_row : {10.0, 180.0, 390.0}) {
    for (const double target_row : {5.0, 220.0, 395.0}) {
      const Vec3 point(0.4, -0.3, 3.0);  // in the host at its instant
      const Vec3 in_host = seen(host_rate_, host_row, point);
      const Vec3 in_target = seen(target_rate_, target_row, T_target_host_ * point);
      const double rho = 1.0 / in_host.z();
      const auto moved = at(host_row, target_row);
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

TEST_F(ViewShiftTest, GrowsWithTheMap) {
  const auto moved = at(380.0, 20.0);
  const Eigen::Vector3f t = T_target_host_.translation().cast<float>();
  EXPECT_LT((moved.applied(1.7F * t) - 1.7F * moved.applied(t)).norm(), 1e-6F);
}

TEST_F(ViewShiftTest, ChainAgreesWithCentralDifferences) {
  const auto moved = at(380.0, 20.0);
  const Vec3 d(120.0, -30.0, 45.0);
  const auto f = [&](const Vec3& t) {
    return Eigen::Matrix<double, 1, 1>(d.dot(moved.applied(t.cast<float>()).cast<double>()));
  };
  const Vec3 t = T_target_host_.translation();
  const Vec3 numeric = test::central_differences<1, 3>(f, t, 1e-2).transpose();
  const Vec3 analytic = moved.chain(d.cast<float>()).cast<double>();
  EXPECT_LT((analytic - numeric).norm(), 1e-3 * numeric.norm());
}

TEST(PairViewShift, IsNoneWithoutARollingShutterAndAPort) {
  EXPECT_TRUE(PairViewShift().none());
  EXPECT_TRUE(PairViewShift(SE3(SO3(), Vec3(1, 0, 0)), {}, {}).none());
}

TEST(PairViewShift, OfAWayShorterThanItselfIsFixed) {
  const ViewShift rows{.per_row = Vec3(0, 0, -1e-3), .middle = kMiddle};
  const PairViewShift shift(SE3(SO3(), Vec3(0, 0, -0.01)), {}, rows);
  const auto moved = shift.at({0.0F, 0.0F}, Eigen::Vector2f(0.0F, 299.5F));
  EXPECT_EQ(moved.share, 0.0F);
  EXPECT_NEAR(moved.applied(Eigen::Vector3f::Zero()).z(), -0.1F, 1e-6F);
}

/// A pinhole whose rays are those of a camera behind a port, in the water.
CameraModel straight_camera(const FlatPort& port) {
  CameraModel camera = test::make_camera(640, 400, 420, 420, 318, 203);
  camera.port = port;
  camera.straightened = true;
  return camera;
}

TEST(PairViewShift, BringsAPointWhereARayThroughThePortShowsIt) {
  const Vec3 tilted = Vec3(0.03, -0.02, 1.0).normalized();
  const CameraModel camera =
      straight_camera({.distance = 0.04, .thickness = 0.02, .normal = tilted, .centre = -0.02});
  ViewShift shift;
  shift.axial = AxialRays::of(camera);
  EXPECT_FALSE(shift.none());
  double most = 0.0;
  for (const Vec3& way : {Vec3(0.2, 0.05, -0.3), Vec3(0.01, 0.0, 0.02)}) {
    const SE3 T(SO3::exp(Vec3(0.05, 0.12, -0.08)), way);
    const PairViewShift pair(T, shift, shift);
    const Eigen::Vector3f t = way.cast<float>();
    for (double u = 20.0; u < 640.0; u += 100.0) {
      for (double v = 20.0; v < 400.0; v += 90.0) {
        // A point on the ray of a host's pixel, and its pixel in the target.
        const double rho = 0.7;
        const Vec3 ray = *camera.unproject({u, v}) / camera.unproject({u, v})->z();
        const Vec3 point = T * (camera.ray_offset(ray) + ray / rho);
        const Vec2 truth = *camera.project(camera.direction_of(point));
        if (!camera.contains(truth)) continue;
        const Vec3 central = T.rotation() * ray + rho * way;
        const Vec2 ignorant = *camera.project(central);
        const auto moved =
            pair.at({static_cast<float>(u), static_cast<float>(v)}, ignorant.cast<float>());
        const Vec3 found = T.rotation() * ray + rho * moved.applied(t).cast<double>();
        const double displacement = (truth - ignorant).norm();
        EXPECT_LT((*camera.project(found) - truth).norm(), 0.003 + 0.05 * displacement);
        most = std::max(most, displacement);
      }
    }
  }
  EXPECT_GT(most, 1.0) << "or the port does nothing";
}

TEST(AxialRays, PassTheNormalWhereThePortSays) {
  const Vec3 tilted = Vec3(0.08, -0.05, 1.0).normalized();
  const CameraModel camera =
      straight_camera({.distance = 0.04, .thickness = 0.02, .normal = tilted, .centre = -0.02});
  const auto rays = AxialRays::of(camera);
  ASSERT_FALSE(rays.none());
  EXPECT_EQ(rays.normal(), tilted);
  for (double u = 1.0; u < 640.0; u += 31.3) {
    for (double v = 1.0; v < 400.0; v += 23.7) {
      const Vec3 direction = *camera.unproject({u, v});
      if (direction.dot(tilted) < 0.766) continue;  // 40 degrees: it falls steeply from there on
      const double exact = camera.port->offset(direction);
      EXPECT_NEAR(rays.offset(static_cast<float>(u), static_cast<float>(v)), exact, 3e-5);
      EXPECT_LT(std::abs(exact), rays.reach());
    }
  }
  EXPECT_EQ(rays.offset(-1e6F, -1e6F), rays.offset(0.0F, 0.0F));
  EXPECT_TRUE(std::isfinite(rays.offset(1e9F, 1e9F)));
  EXPECT_EQ(rays.offset(NAN, NAN), rays.offset(0.0F, 0.0F));
  EXPECT_TRUE(AxialRays::of(test::make_camera(640, 400, 420, 420, 318, 203)).none());
}

TEST(PairViewShift, LooksForThePixelWithinTheImage) {
  ViewShift rows{.per_row = Vec3(0, 0, -1e-3), .middle = kMiddle};
  const PairViewShift shift(SE3(SO3(), Vec3(0, 0, -1.0)), rows, rows);
  const Eigen::Vector2f host(100.0F, 150.0F);
  const Eigen::Vector3f t(0, 0, -1);
  const auto z_at = [&](const Eigen::Vector3f& seen) {
    return shift.at(host, seen, 640, 400).applied(t).z();
  };
  const auto z_of = [&](const Eigen::Vector2f& pixel) {
    return shift.at(host, pixel).applied(t).z();
  };
  EXPECT_EQ(z_at({50.0F, 360.0F, 2.0F}), z_of({25.0F, 180.0F}));
  EXPECT_EQ(z_at({50.0F, 3600.0F, 2.0F}), z_of({25.0F, 400.0F}));
  EXPECT_EQ(z_at({50.0F, 360.0F, -2.0F}), z_of(host));
}

}  // namespace
}  // namespace sovo
