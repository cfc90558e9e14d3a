#include "sovo/bridge/camera_diagnostics.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

namespace sovo::bridge {
namespace {

/// The values of a status by their keys.
std::map<std::string, std::string> values_of(const msg::DiagnosticStatus& status) {
  std::map<std::string, std::string> values;
  for (std::uint32_t i = 0; i < status.values._length; ++i) {
    values[status.values._buffer[i].key] = status.values._buffer[i].value;
  }
  return values;
}

TEST(CameraDiagnostics, EveryDeviceHasAStatusOfItsOwn) {
  LiveReport report;
  report.cameras.resize(2);
  report.cameras[0].name = "left";
  report.cameras[0].state = CameraState::kStreaming;
  report.cameras[0].device = "/dev/video0";
  report.cameras[0].counts.images = 12;
  report.cameras[0].temperature_c = 41.5;
  report.cameras[0].stream = {{"resent_packets", "3"}};
  report.cameras[1].name = "right";
  report.cameras[1].state = CameraState::kLost;
  report.cameras[1].message = "the camera went away";
  report.cameras[1].counts.disconnects = 2;
  report.pairs.unpaired_left = 7;
  report.queue_dropped = 1;
  const CameraDiagnosticsMessage diagnostics("sovo: camera", report, 5'000'000'007);
  const msg::DiagnosticArray& array = diagnostics.message();
  EXPECT_EQ(array.header.stamp.sec, 5);
  ASSERT_EQ(array.status._length, 3U);
  const auto* status = array.status._buffer;
  EXPECT_EQ(status[0].level, 0);
  EXPECT_STREQ(status[0].name, "sovo: camera: left");
  EXPECT_STREQ(status[0].message, "streaming");
  EXPECT_STREQ(status[0].hardware_id, "/dev/video0");
  EXPECT_EQ(values_of(status[0]).at("images"), "12");
  EXPECT_EQ(values_of(status[0]).at("resent_packets"), "3");
  EXPECT_EQ(values_of(status[0]).at("temperature_c").substr(0, 4), "41.5");
  EXPECT_EQ(status[1].level, 2);
  EXPECT_STREQ(status[1].message, "lost: the camera went away");
  EXPECT_EQ(values_of(status[1]).at("disconnects"), "2");
  EXPECT_EQ(status[2].level, 1);
  EXPECT_EQ(values_of(status[2]).at("unpaired_left"), "7");
}

}  // namespace
}  // namespace sovo::bridge
