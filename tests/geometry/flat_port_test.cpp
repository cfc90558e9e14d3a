#include "sovo/geometry/flat_port.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "sovo/geometry/radtan_fit.h"
#include "support/cameras.h"
#include "support/numeric.h"

namespace sovo {
namespace {

/// A ray in water, traced face by face by the angles of Snell's law.
struct TracedRay {
  Vec3 origin;     ///< On the outer face.
  Vec3 direction;  ///< Unit.
};

TracedRay trace_ray(const FlatPort& port, const Vec3& bearing) {
  const Vec3 n = port.normal;
  const Vec3 aside = (bearing - bearing.dot(n) * n).normalized();
  const double air = std::acos(bearing.dot(n));
  const double glass = std::asin(std::sin(air) / port.glass);
  const double water = std::asin(std::sin(air) / port.water);
  const double along = port.distance * std::tan(air) + port.thickness * std::tan(glass);
  return {(port.distance + port.thickness) * n + along * aside,
          std::cos(water) * n + std::sin(water) * aside};
}

std::vector<FlatPort> ports() {
  const Vec3 tilted = Vec3(0.08, -0.05, 1.0).normalized();
  return {{.distance = 0.02, .thickness = 0.008},
          {.distance = 0.05, .thickness = 0.012, .glass = 1.77, .water = 1.345},
          {.distance = 0.03, .thickness = 0.01, .normal = tilted},
          {.distance = 0.0, .thickness = 0.006, .glass = 1.52, .centre = 0.001}};
}

std::vector<Vec3> bearings() {
  std::vector<Vec3> out;
  for (double x = -1.5; x <= 1.5; x += 0.5) {
    for (double y = -0.9; y <= 0.9; y += 0.45) out.push_back(Vec3(x + 0.01, y, 1.0).normalized());
  }
  return out;
}

TEST(FlatPort, BendsRaysByTheAnglesOfSnellsLaw) {
  for (const FlatPort& port : ports()) {
    for (const Vec3& bearing : bearings()) {
      const auto water = port.to_water(bearing);
      ASSERT_TRUE(water);
      EXPECT_LT((*water - trace_ray(port, bearing).direction).norm(), 1e-12);
      const auto air = port.to_air(2.5 * *water);
      ASSERT_TRUE(air);
      EXPECT_LT((air->normalized() - bearing).norm(), 1e-12);
    }
  }
  // 45 degrees in air are 32.04 in fresh water.
  const Vec3 water = *FlatPort().to_water(Vec3(1.0, 0.0, 1.0).normalized());
  EXPECT_NEAR(std::atan2(water.x(), water.z()) * 180.0 / M_PI, 32.04, 0.005);
}

TEST(FlatPort, RaysPassTheNormalWhereTracedOnesDo) {
  for (const FlatPort& port : ports()) {
    for (const Vec3& bearing : bearings()) {
      const TracedRay ray = trace_ray(port, bearing);
      const Vec3 passed = (port.centre + port.offset(3.0 * ray.direction)) * port.normal;
      // On the traced ray, and on the normal.
      const double length = (passed - ray.origin).dot(ray.direction);
      EXPECT_LT((ray.origin + length * ray.direction - passed).norm(), 1e-9);
      EXPECT_LT(length, 0.0) << "behind the pane";
    }
  }
}

TEST(FlatPort, JacobianOfTheRefractionAgreesWithCentralDifferences) {
  for (const FlatPort& port : ports()) {
    for (const Vec3& bearing : bearings()) {
      const Vec3 water = 1.7 * *port.to_water(bearing);
      Mat3 jacobian;
      ASSERT_TRUE(port.to_air(water, &jacobian));
      const auto f = [&](const Vec3& d) { return *port.to_air(d); };
      const Mat3 numeric = test::central_differences<3, 3>(f, water);
      EXPECT_LT(test::relative_difference(jacobian, numeric), 1e-6);
    }
  }
}

TEST(FlatPort, NoLightComesFromBeyondTheCriticalAngle) {
  const FlatPort port;
  const auto at = [](double degrees) {
    return Vec3(std::sin(degrees * M_PI / 180.0), 0.0, std::cos(degrees * M_PI / 180.0));
  };
  EXPECT_TRUE(port.to_air(at(48.0)));  // asin(1 / 1.333) is 48.6 degrees
  EXPECT_FALSE(port.to_air(at(49.0)));
  EXPECT_FALSE(port.to_air(at(170.0)));
  EXPECT_FALSE(port.to_water(at(90.0)));
  EXPECT_FALSE(port.to_water(at(120.0)));
  EXPECT_TRUE(std::isfinite(port.offset(at(60.0))));
}

TEST(FlatPort, OfWaterThatIsAirDoesNothing) {
  const FlatPort none{.distance = 0.1, .thickness = 0.02, .glass = 1.0, .water = 1.0};
  for (const Vec3& bearing : bearings()) {
    EXPECT_LT((*none.to_water(bearing) - bearing).norm(), 1e-15);
    EXPECT_NEAR(none.offset(bearing), 0.0, 1e-15);
  }
}

TEST(FlatPort, KnowsWhatCannotBe) {
  EXPECT_TRUE(FlatPort().is_possible());
  EXPECT_FALSE((FlatPort{.distance = -0.01}.is_possible()));
  EXPECT_FALSE((FlatPort{.distance = 20.0}.is_possible())) << "millimetres";
  EXPECT_FALSE((FlatPort{.thickness = NAN}.is_possible()));
  EXPECT_FALSE((FlatPort{.glass = 0.9}.is_possible()));
  EXPECT_FALSE((FlatPort{.water = 2.0}.is_possible()));
  EXPECT_FALSE((FlatPort{.normal = {0.0, 0.0, 2.0}}.is_possible()));
  EXPECT_FALSE((FlatPort{.normal = {1.0, 0.0, 0.0}}.is_possible()));
}

/// Cameras with lenses of all kinds behind ports.
std::vector<CameraModel> submerged() {
  const std::vector<CameraModel> lenses = {
      test::make_camera(640, 400, 350, 352, 316, 203), test::euroc_left(),
      test::make_camera(640, 400, 300, 300, 321.5, 200.5, Distortion::kEquidistant,
                        {-0.012, 0.004, -0.003, 0.0006})};
  std::vector<CameraModel> out;
  for (const CameraModel& lens : lenses) {
    for (const FlatPort& port : ports()) {
      out.push_back(lens);
      out.back().port = port;
      out.back().port->centre = *centre_behind_port(out.back());
    }
  }
  return out;
}

TEST(CameraBehindAPort, SeesPointsWhereTracedRaysLead) {
  for (const CameraModel& camera : submerged()) {
    CameraModel air = camera;
    air.port.reset();
    const Vec3 centre = camera.port->centre * camera.port->normal;
    for (int y = 3; y < camera.height; y += 45) {
      for (int x = 3; x < camera.width; x += 45) {
        const Vec3 bearing = *air.unproject({x, y});
        if (bearing.dot(camera.port->normal) < 0.4) continue;  // 66 degrees
        const TracedRay ray = trace_ray(*camera.port, bearing);
        for (const double distance : {0.3, 1.0, 40.0}) {
          const Vec3 point = ray.origin + distance * ray.direction - centre;
          const auto pixel = camera.project(camera.direction_of(point));
          ASSERT_TRUE(pixel);
          EXPECT_LT((*pixel - Vec2(x, y)).norm(), 2e-3) << distance;
        }
        const auto direction = camera.unproject({x, y});
        ASSERT_TRUE(direction);
        EXPECT_LT((*direction - ray.direction).norm(), 1e-9);
      }
    }
  }
}

TEST(CameraBehindAPort, JacobianAgreesWithCentralDifferences) {
  for (const CameraModel& camera : submerged()) {
    for (const Vec2& pixel : {Vec2(40, 30), Vec2(330, 210), Vec2(600, 380)}) {
      const Vec3 direction = 2.0 * *camera.unproject(pixel);
      Mat23 jacobian;
      ASSERT_TRUE(camera.project(direction, &jacobian));
      const auto f = [&](const Vec3& d) { return *camera.project(d); };
      const Mat23 numeric = test::central_differences<2, 3>(f, direction);
      EXPECT_LT(test::relative_difference(jacobian, numeric), 1e-6);
    }
  }
}

TEST(CameraBehindAPort, HasItsOriginAmongItsRays) {
  for (const CameraModel& camera : submerged()) {
    double least = 1.0;
    double most = -1.0;
    for (int y = 0; y < camera.height; y += 8) {
      for (int x = 0; x < camera.width; x += 8) {
        const double offset = camera.port->offset(*camera.unproject({x, y}));
        least = std::min(least, offset);
        most = std::max(most, offset);
      }
    }
    EXPECT_LT(least, 0.0);
    EXPECT_GT(most, 0.0);
  }
  CameraModel blind = test::make_camera(640, 400, 350, 350, 320, 200);
  blind.port = FlatPort{.normal = {0.0, 0.0, -1.0}};
  EXPECT_FALSE(centre_behind_port(blind));
}

TEST(CameraBehindAPort, AsACameraWithoutPortSeesTheSameDirections) {
  for (const CameraModel& camera : submerged()) {
    const auto fit = fit_radtan(camera);
    ASSERT_TRUE(fit);
    EXPECT_FALSE(fit->camera.port);
    // A pane that is tilted by five degrees radtan distortion cannot follow.
    if (camera.port->normal.z() == 1.0) {
      EXPECT_LT(fit->worst_px, 0.3);
    }
    double worst = 0.0;
    for (int y = 7; y < camera.height; y += 30) {
      for (int x = 7; x < camera.width; x += 30) {
        const auto pixel = fit->camera.project(*camera.unproject({x, y}));
        ASSERT_TRUE(pixel);
        worst = std::max(worst, (*pixel - Vec2(x, y)).norm());
      }
    }
    EXPECT_LT(worst, fit->worst_px + 0.05);
  }
}

TEST(RadtanFit, FindsTheLensThatItIs) {
  const CameraModel lens = test::euroc_left();
  const auto fit = fit_radtan(lens);
  ASSERT_TRUE(fit);
  EXPECT_LT(fit->worst_px, 0.01);
}

TEST(RadtanFit, LeavesCamerasWithoutAPort) {
  StereoRig rig;
  rig.left = test::tumvi_left();
  rig.right = submerged().front();
  const StereoRig plain = without_ports(rig);
  EXPECT_EQ(plain.left.distortion, Distortion::kEquidistant);
  EXPECT_EQ(plain.left.fx, rig.left.fx);
  EXPECT_FALSE(plain.right.port);
  EXPECT_NEAR(plain.right.fx, 1.333 * rig.right.fx, 0.02 * rig.right.fx);
  rig.right.port->normal = {0.0, 0.0, -1.0};
  EXPECT_EQ(without_ports(rig).right.fx, 0.0);
}

}  // namespace
}  // namespace sovo
