#include <gtest/gtest.h>

#include <string>

#include "io/calibration_test_support.h"
#include "io/io_test_support.h"
#include "sovo/io/calibration.h"

namespace sovo {
namespace {

/// The rig with both cameras behind ports, as a file has it.
std::string with_ports() {
  std::string text = format_sovo_calibration(some_rig());
  text = with(text, "left:", "water: 1.34\nleft:\n  port: {distance: 0.02, thickness: 0.008}\n#");
  return with(text,
              "right:", "right:\n  port: {distance: 0.03, glass: 1.52, normal: [0.02, 0, 2]}\n#");
}

TEST(CalibrationWithPorts, CamerasBehindPortsHaveTheirOriginsAmongTheRaysInWater) {
  const TemporaryFolder folder;
  const auto loaded = load_calibration(folder.write("calibration.yaml", with_ports()));
  ASSERT_TRUE(loaded) << loaded.error();
  const StereoRig rig = loaded->rig;
  const StereoRig air = some_rig();
  expect_same_camera(rig.left, air.left);
  ASSERT_TRUE(rig.left.port && rig.right.port);
  EXPECT_EQ(rig.left.port->distance, 0.02);
  EXPECT_EQ(rig.left.port->thickness, 0.008);
  EXPECT_EQ(rig.left.port->water, 1.34);
  EXPECT_EQ(rig.right.port->glass, 1.52);
  EXPECT_NEAR(rig.right.port->normal.x(), 0.01, 1e-6);
  EXPECT_NEAR(rig.right.port->normal.norm(), 1.0, 1e-15);
  EXPECT_LT(rig.left.port->centre, -0.005) << "behind the camera";
  // A point is the same one, seen from the origins behind the ports.
  const auto origin = [](const CameraModel& c) { return Vec3(c.port->centre * c.port->normal); };
  const Vec3 point(0.3, -0.2, 2.0);
  const Vec3 in_right = rig.T_right_left * Vec3(point - origin(rig.left));
  EXPECT_LT((in_right + origin(rig.right) - air.T_right_left * point).norm(), 1e-12);
  const Vec3 in_base = rig.T_base_left * Vec3(point - origin(rig.left));
  EXPECT_LT((in_base - air.T_base_left * point).norm(), 1e-12);

  const std::string text = format_sovo_calibration(rig);
  const auto again = load_calibration(folder.write("again.yaml", text));
  ASSERT_TRUE(again) << again.error();
  EXPECT_LT(distance(again->rig.T_right_left, rig.T_right_left), 1e-12);
  EXPECT_LT(distance(again->rig.T_base_left, rig.T_base_left), 1e-12);
  EXPECT_EQ(again->rig.right.port->normal, rig.right.port->normal);
  EXPECT_EQ(again->rig.right.port->centre, rig.right.port->centre);
}

TEST(CalibrationWithPorts, PortsThatCannotBeAreNamed) {
  const TemporaryFolder folder;
  const auto error = [&](const std::string& from, const std::string& to) {
    return load_error(folder.write("s.yaml", with(with_ports(), from, to)));
  };
  EXPECT_TRUE(contains(error("water: 1.34", "water: 0"), "'left' has a 'port', but"));
  EXPECT_TRUE(contains(error("water: 1.34", "water: 134"), "'water' the index of refraction"));
  EXPECT_TRUE(contains(error("distance: 0.02", "distance: 20"), "0 to 0.5 m"));
  EXPECT_TRUE(contains(error("distance: 0.02, ", ""), "'left' 'port' needs 'distance'"));
  EXPECT_TRUE(contains(error("thickness: 0.008", "thickness: 8"), "0 to 0.2 m"));
  EXPECT_TRUE(contains(error("glass: 1.52", "glass: 0"), "1 to 2.5"));
  EXPECT_TRUE(contains(error("[0.02, 0, 2]", "[0, 0]"), "three numbers"));
  EXPECT_TRUE(contains(error("[0.02, 0, 2]", "[2, 0, 1]"), "25 degrees"));
  EXPECT_TRUE(contains(error("distance: 0.02", "distnace: 0.02"), "did you mean 'distance'"));
}

TEST(CalibrationWithPorts, RosHasCamerasBehindPortsAsTheyAreInWater) {
  const TemporaryFolder folder;
  const auto loaded = load_calibration(folder.write("calibration.yaml", with_ports()));
  ASSERT_TRUE(loaded) << loaded.error();
  const CameraInfoPair pair = format_ros_calibration(loaded->rig);
  folder.write("right.yaml", pair.right);
  const auto ros = load_calibration(folder.write("left.yaml", pair.left));
  ASSERT_TRUE(ros) << ros.error();
  EXPECT_FALSE(ros->rig.left.port);
  EXPECT_EQ(ros->rig.left.num_coefficients, 8);
  EXPECT_LT(distance(ros->rig.T_right_left, loaded->rig.T_right_left), 1e-6);
  for (const Vec2& pixel : {Vec2(100, 90), Vec2(320, 240), Vec2(500, 400)}) {
    const Vec3 direction = *loaded->rig.left.unproject(pixel);
    EXPECT_LT((*ros->rig.left.project(direction) - pixel).norm(), 0.1);
  }
}

}  // namespace
}  // namespace sovo
