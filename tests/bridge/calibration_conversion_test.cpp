#include "sovo/bridge/calibration_conversion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "sovo/bridge/borrow.h"
#include "test_cameras.h"

namespace sovo::bridge {
namespace {

TEST(CalibrationConversion, ThereAndBack) {
  const StereoCameras cameras = test_cameras();
  const CalibrationMessage message(cameras, "left_frame", 5);
  EXPECT_STREQ(message.message().header.frame_id, "left_frame");
  const auto back = from_message(message.message());
  ASSERT_TRUE(back.ok()) << back.error();
  EXPECT_EQ(back->rig.name, "cam");
  for (const auto& [a, b] : {std::pair(&cameras.rig.left, &back->rig.left),
                             std::pair(&cameras.rig.right, &back->rig.right)}) {
    EXPECT_EQ(a->width, b->width);
    EXPECT_EQ(a->height, b->height);
    EXPECT_EQ(a->fx, b->fx);
    EXPECT_EQ(a->fy, b->fy);
    EXPECT_EQ(a->cx, b->cx);
    EXPECT_EQ(a->cy, b->cy);
    EXPECT_EQ(a->distortion, b->distortion);
    EXPECT_EQ(a->d, b->d);
    EXPECT_EQ(a->num_coefficients, b->num_coefficients);
  }
  EXPECT_TRUE(back->rig.T_right_left.matrix().isApprox(cameras.rig.T_right_left.matrix(), 1e-12));
  EXPECT_TRUE(back->rig.T_base_left.matrix().isApprox(cameras.rig.T_base_left.matrix(), 1e-12));
  EXPECT_EQ(back->left_photometric.inverse_response, cameras.left_photometric.inverse_response);
  ASSERT_EQ(back->left_photometric.vignette.size(), cameras.left_photometric.vignette.size());
  EXPECT_NEAR(back->left_photometric.vignette.at(700, 400),
              cameras.left_photometric.vignette.at(700, 400), 1e-5);
  EXPECT_TRUE(back->right_photometric.empty());
}

/// The same cameras behind ports.
StereoCameras submerged_cameras() {
  StereoCameras cameras = test_cameras();
  const Vec3 normal = Vec3(0.01, 0.02, 1.0).normalized();
  cameras.rig.left.port = {.distance = 0.02, .thickness = 0.008, .normal = normal, .centre = -0.01};
  cameras.rig.right.port = {.distance = 0.03, .glass = 1.52, .water = 1.34};
  return cameras;
}

TEST(CalibrationConversion, PortsThereAndBack) {
  const StereoCameras cameras = submerged_cameras();
  const CalibrationMessage message(cameras, "left_frame", 5);
  EXPECT_STREQ(message.message().left.model, "pinhole_flat_port");
  const auto back = from_message(message.message());
  ASSERT_TRUE(back.ok()) << back.error();
  for (const auto& [a, b] : {std::pair(&cameras.rig.left, &back->rig.left),
                             std::pair(&cameras.rig.right, &back->rig.right)}) {
    EXPECT_EQ(a->d, b->d);
    EXPECT_EQ(a->num_coefficients, b->num_coefficients);
    ASSERT_TRUE(b->port);
    EXPECT_EQ(a->port->distance, b->port->distance);
    EXPECT_EQ(a->port->thickness, b->port->thickness);
    EXPECT_EQ(a->port->glass, b->port->glass);
    EXPECT_EQ(a->port->water, b->port->water);
    EXPECT_EQ(a->port->normal, b->port->normal);
    EXPECT_EQ(a->port->centre, b->port->centre);
  }
}

TEST(CalibrationConversion, PortsThatCannotBeAreRefused) {
  using M = msg::StereoCalibration;
  const std::vector<std::function<void(M&)>> cases = {
      [](M& m) { m.left.d._buffer[m.left.d._length - 8] = -0.02; },
      [](M& m) { m.left.d._buffer[m.left.d._length - 5] = 3.0; },
      [](M& m) { m.left.d._buffer[m.left.d._length - 2] = 0.0; },
      [](M& m) { m.left.d._buffer[m.left.d._length - 1] = 5.0; },
      [](M& m) { m.left.d._length -= 1; },
      [](M& m) { m.left.d._length = 7; },
      [](M& m) { m.left.model = borrow("pinhole"); },
  };
  for (const auto& spoil : cases) {
    const CalibrationMessage original(submerged_cameras(), "left", 0);
    M message = original.message();
    spoil(message);
    const auto result = from_message(message);
    ASSERT_FALSE(result.ok()) << &spoil - cases.data();
    EXPECT_NE(result.error().find("left.d"), std::string::npos) << result.error();
  }
}

TEST(CalibrationConversion, MalformedMessagesAreRefusedByField) {
  using M = msg::StereoCalibration;
  const std::vector<std::pair<std::string, std::function<void(M&)>>> cases = {
      {"left: size", [](M& m) { m.left.width = 0; }},
      {"right: size", [](M& m) { m.right.height = 0xFFFFFFFF; }},
      {"left.model", [](M& m) { m.left.model = borrow("omni"); }},
      {"left.fx_fy_cx_cy", [](M& m) { m.left.fx_fy_cx_cy[0] = -1.0; }},
      {"right.fx_fy_cx_cy", [](M& m) { m.right.fx_fy_cx_cy[2] = NAN; }},
      {"left.distortion_model", [](M& m) { m.left.distortion_model = nullptr; }},
      {"left.d", [](M& m) { m.left.d._length = 3; }},
      {"right.d", [](M& m) { m.right.d._buffer[0] = INFINITY; }},
      {"left.response", [](M& m) { m.left.response._length = 255; }},
      {"left.vignette", [](M& m) { m.left.vignette._length -= 1; }},
      {"right_from_left",
       [](M& m) {
         m.right_from_left.rotation = {0, 0, 0, 0};
       }},
      {"base_from_left", [](M& m) { m.base_from_left.translation.x = NAN; }},
      {"metres", [](M& m) { m.right_from_left.translation.x = -110.0; }},
      {"right_from_left",
       [](M& m) {
         m.right_from_left.translation = {0, 0, 0};
       }},
  };
  for (const auto& [field, spoil] : cases) {
    const CalibrationMessage original(test_cameras(), "left", 0);
    M message = original.message();
    ASSERT_TRUE(from_message(message).ok());
    spoil(message);
    const auto result = from_message(message);
    ASSERT_FALSE(result.ok()) << field;
    EXPECT_NE(result.error().find(field), std::string::npos) << result.error();
  }
}

}  // namespace
}  // namespace sovo::bridge
