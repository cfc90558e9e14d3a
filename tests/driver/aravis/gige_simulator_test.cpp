#include "driver/aravis/gige_simulator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <memory>

#include "driver/aravis/aravis_fixture.h"
#include "sovo/driver/aravis/gige_network.h"
#include "sovo/driver/live/host_clock.h"

namespace sovo::gige {
namespace {

constexpr int kSimWidth = 160;
constexpr int kSimHeight = 120;

GigeSimulatorConfig simulated(const std::string& serial) {
  GigeSimulatorConfig config;
  config.serial = serial;
  config.address = serial == "LEFT" ? "127.0.0.2" : "127.0.0.3";
  config.clock_ppm = serial == "LEFT" ? 30.0 : -40.0;
  config.clock_offset_ns = serial == "LEFT" ? 5'000'000'000 : 7'000'000'000'000;
  return config;
}

GigeSimulatorConfig without_ptp(const std::string& serial) {
  GigeSimulatorConfig config = simulated(serial);
  config.ptp = config.action = false;
  return config;
}

/// The instant that an image shows; it is whole.
std::int64_t instant_shown(const SideImage& image) {
  EXPECT_EQ(image.width, kSimWidth);
  EXPECT_EQ(image.height, kSimHeight);
  const std::int64_t instant = instant_of(image.data->data());
  std::vector<std::uint8_t> wanted(std::size_t{kSimWidth} * kSimHeight);
  paint_instant(instant, &wanted);
  EXPECT_TRUE(std::equal(wanted.begin(), wanted.end(), image.data->begin()));
  return instant;
}

/// Time between the instants that both sides show [ns]; the images are whole.
std::int64_t apart(const StereoFrame& frame) {
  return std::abs(instant_shown(frame.left) - instant_shown(frame.right));
}

using GigeSimulatorTest = AravisTest;

TEST_F(GigeSimulatorTest, ScheduledActionsExposeBothAtOneInstant) {
  GigeSimulator left(simulated("LEFT"));
  GigeSimulator right(simulated("RIGHT"));
  ASSERT_TRUE(left.is_running() && right.is_running());
  options_.frame_rate = 10.0;
  auto opened = open(kSimWidth, kSimHeight);
  ASSERT_TRUE(opened) << opened.error();
  LiveSource& source = *opened->source;
  const auto frames = take(&source, 12, [](const StereoFrame& frame) {
    return frame.left.valid && frame.right.valid && frame.clock == 2;
  });
  ASSERT_EQ(frames.size(), 12U);
  for (const StereoFrame& frame : frames) {
    EXPECT_EQ(apart(frame), 0);
    EXPECT_LT(frame.pair_error_s, 1e-9);
    // Half of 3 ms of exposure later; the reading of the clock is good to 5 ms.
    const std::int64_t middle = instant_of(frame.left.data->data()) + 1'500'000;
    EXPECT_LT(std::abs(frame.stamp_ns - middle), 10'000'000);
  }
  const LiveReport report = report_when(&source, [](const LiveReport& r) {
    return number(r.cameras[0], "actions_accepted") > 0 &&
           number(r.cameras[1], "actions_accepted") > 0;
  });
  for (const CameraReport& camera : report.cameras) {
    EXPECT_EQ(counter(camera, "sync"), "action");
    EXPECT_EQ(counter(camera, "ptp_status"), "Slave");
    EXPECT_GT(number(camera, "actions_accepted"), 0.0);
    EXPECT_DOUBLE_EQ(camera.temperature_c.value_or(0.0), 41.5);
  }
  EXPECT_GE(left.counts().actions, 12U);
}

TEST_F(GigeSimulatorTest, LostPacketsAreSentAgain) {
  GigeSimulator left(without_ptp("LEFT"));
  GigeSimulator right(without_ptp("RIGHT"));
  ASSERT_TRUE(left.is_running() && right.is_running());
  options_.sync = aravis::Sync::kFree;
  options_.packet_size = 576;
  live_.pair_tolerance_ms = 1000.0;  // each runs by itself
  left.lose_packets(0.03);
  auto opened = open(kSimWidth, kSimHeight);
  ASSERT_TRUE(opened) << opened.error();
  const auto frames = take(opened->source.get(), 30);
  ASSERT_EQ(frames.size(), 30U);
  for (const StereoFrame& frame : frames) apart(frame);
  const LiveReport report = report_when(opened->source.get(), [](const LiveReport& r) {
    return number(r.cameras[0], "resent_packets") > 0;
  });
  EXPECT_GT(number(report.cameras[0], "resent_packets"), 0.0);
  EXPECT_EQ(counter(report.cameras[0], "packet_size"), "576");
  EXPECT_GT(left.counts().packets_lost, 0U);
  EXPECT_GT(left.counts().packets_resent, 0U);
  // An image that could not be mended was dropped, and counted.
  const CameraCounts& counts = report.cameras[0].counts;
  EXPECT_EQ(counts.damaged > 0, number(report.cameras[0], "failures") > 0) << counts.damaged;
}

TEST_F(GigeSimulatorTest, WithoutResendLossesAreCounted) {
  GigeSimulatorConfig deaf = without_ptp("LEFT");
  deaf.resend = false;
  GigeSimulator left(deaf);
  GigeSimulator right(without_ptp("RIGHT"));
  ASSERT_TRUE(left.is_running() && right.is_running());
  options_.sync = aravis::Sync::kFree;
  options_.packet_size = 576;
  options_.resend = false;
  left.lose_packets(0.01);
  auto opened = open(kSimWidth, kSimHeight);
  ASSERT_TRUE(opened) << opened.error();
  const LiveReport report = report_when(opened->source.get(), [](const LiveReport& r) {
    return r.cameras[0].counts.damaged >= 3 && r.cameras[0].counts.images >= 3;
  });
  EXPECT_GE(report.cameras[0].counts.damaged, 3U);
  EXPECT_GE(report.cameras[0].counts.images, 3U);
  EXPECT_EQ(left.counts().packets_resent, 0U);
}

/// Cameras on one port of 32 Mbit/s, which keeps five packets, told to send at once by software.
class OnePort : public GigeSimulatorTest {
 protected:
  void SetUp() override {
    GigeSimulatorTest::SetUp();
    options_.sync = aravis::Sync::kSoftware;
    options_.frame_rate = 10.0;
    options_.packet_size = 1400;
    options_.resend = false;
  }

  /// Takes 20 images of each camera, whole or damaged, and gives the report.
  LiveReport watch(bool with_feature) {
    GigeSimulatorConfig left = without_ptp("LEFT");
    GigeSimulatorConfig right = without_ptp("RIGHT");
    left.port = right.port = port_;
    left.throughput_limit = right.throughput_limit = with_feature;
    GigeSimulator left_camera(left);
    GigeSimulator right_camera(right);
    EXPECT_TRUE(left_camera.is_running() && right_camera.is_running());
    auto opened = open(kSimWidth, kSimHeight);
    EXPECT_TRUE(opened) << opened.error();
    if (!opened) return {};
    return report_when(opened->source.get(), [](const LiveReport& report) {
      return std::all_of(report.cameras.begin(), report.cameras.end(), [](const auto& camera) {
        return camera.counts.images + camera.counts.damaged >= 20;
      });
    });
  }

  std::shared_ptr<SharedPort> port_ = std::make_shared<SharedPort>(32e6 / 8, 5 * 1400);
};

TEST_F(OnePort, IsTooSmallForTwoCamerasThatSendAsFastAsTheyCan) {
  const LiveReport report = watch(true);
  ASSERT_EQ(report.cameras.size(), 2U);
  EXPECT_GT(port_->dropped(), 100U);
  EXPECT_GT(report.cameras[0].counts.damaged + report.cameras[1].counts.damaged, 20U);
}

TEST_F(OnePort, CarriesBothWhenEachIsLimitedToItsShare) {
  options_.throughput_mbps = aravis::port_share(32);
  for (const bool with_feature : {true, false}) {
    const LiveReport report = watch(with_feature);
    ASSERT_EQ(report.cameras.size(), 2U);
    EXPECT_EQ(port_->dropped(), 0U) << with_feature;
    for (const CameraReport& camera : report.cameras) {
      EXPECT_GE(camera.counts.images, 20U);
      EXPECT_EQ(camera.counts.damaged, 0U);
      EXPECT_EQ(counter(camera, "throughput_limit_mbps"), "14");
    }
  }
}

TEST_F(GigeSimulatorTest, ChunksBringTheExposureOfEachImage) {
  GigeSimulator left(without_ptp("LEFT"));
  GigeSimulatorConfig plain = without_ptp("RIGHT");
  plain.chunks = false;
  GigeSimulator right(plain);
  ASSERT_TRUE(left.is_running() && right.is_running());
  options_.sync = aravis::Sync::kFree;
  live_.pair_tolerance_ms = 1000.0;
  auto opened = open(kSimWidth, kSimHeight);
  ASSERT_TRUE(opened) << opened.error();
  for (const StereoFrame& frame : take(opened->source.get(), 3)) {
    EXPECT_NEAR(frame.left.exposure_s, 3e-3, 1e-9);   // the image's own
    EXPECT_NEAR(frame.right.exposure_s, 5e-3, 1e-9);  // as the camera is set
    EXPECT_EQ(frame.clock, 1);
    apart(frame);
  }
}

TEST_F(GigeSimulatorTest, AnUnpluggedCameraReturnsWithItsFeatures) {
  GigeSimulator left(without_ptp("LEFT"));
  GigeSimulator right(without_ptp("RIGHT"));
  ASSERT_TRUE(left.is_running() && right.is_running());
  options_.features = {"ExposureTime=4000"};
  options_.sync = aravis::Sync::kFree;
  live_.pair_tolerance_ms = 1000.0;
  auto opened = open(kSimWidth, kSimHeight);
  ASSERT_TRUE(opened) << opened.error();
  LiveSource& source = *opened->source;
  ASSERT_EQ(take(&source, 3).size(), 3U);
  EXPECT_DOUBLE_EQ(right.exposure_us(), 4000.0);
  right.unplug();
  const LiveReport lost = report_when(&source, [](const LiveReport& r) {
    return r.cameras[1].counts.disconnects == 1 && r.cameras[1].counts.open_failures > 0;
  });
  EXPECT_EQ(lost.cameras[1].state, CameraState::kLost);
  EXPECT_EQ(lost.cameras[1].counts.disconnects, 1U);
  EXPECT_TRUE(contains(lost.cameras[1].message, "no GigE Vision camera is 'RIGHT'"))
      << lost.cameras[1].message;
  EXPECT_EQ(lost.cameras[0].state, CameraState::kStreaming);
  // Left images go on alone.
  const auto alone = take(&source, 3, [](const StereoFrame& frame) { return !frame.right.valid; });
  EXPECT_EQ(alone.size(), 3U);
  right.plug();
  const LiveReport back =
      report_when(&source, [](const LiveReport& r) { return r.cameras[1].counts.reconnects == 1; });
  EXPECT_EQ(back.cameras[1].counts.reconnects, 1U);
  EXPECT_EQ(back.cameras[1].state, CameraState::kStreaming);
  EXPECT_DOUBLE_EQ(right.exposure_us(), 4000.0);
  const auto pairs = take(&source, 3);
  ASSERT_EQ(pairs.size(), 3U);
  for (const StereoFrame& frame : pairs) apart(frame);
}

TEST_F(GigeSimulatorTest, SoftwareTriggersGoToBothAtOnce) {
  GigeSimulator left(without_ptp("LEFT"));
  GigeSimulator right(without_ptp("RIGHT"));
  ASSERT_TRUE(left.is_running() && right.is_running());
  options_.frame_rate = 5.0;
  auto opened = open(kSimWidth, kSimHeight);
  ASSERT_TRUE(opened) << opened.error();
  const auto frames = take(opened->source.get(), 5);
  ASSERT_EQ(frames.size(), 5U);
  // A quarter of the period, and what the readings of two clocks may be off.
  for (const StereoFrame& frame : frames) EXPECT_LT(apart(frame), 60'000'000);
  const LiveReport report = report_when(opened->source.get(), [](const LiveReport& r) {
    return counter(r.cameras[0], "sync") == "software";
  });
  EXPECT_EQ(counter(report.cameras[1], "sync"), "software");
  EXPECT_GE(left.counts().software_triggers, 5U);
}

TEST_F(GigeSimulatorTest, ATriggerLineIsPairedByTrackedClocks) {
  GigeSimulator left(without_ptp("LEFT"));
  GigeSimulator right(without_ptp("RIGHT"));
  ASSERT_TRUE(left.is_running() && right.is_running());
  options_.trigger_source = "Line0";
  options_.frame_rate = 10.0;
  auto opened = open(kSimWidth, kSimHeight);
  ASSERT_TRUE(opened) << opened.error();
  report_when(opened->source.get(), [&](const LiveReport&) {
    return left.counts().acquisitions > 0 && right.counts().acquisitions > 0;
  });
  std::vector<StereoFrame> frames;
  for (int i = 0; i < 200 && frames.size() < 8; ++i) {
    const std::int64_t now = read_host_clock().utc_ns;
    left.trigger_line(now);
    if (i % 5 != 2) right.trigger_line(now);  // the right one misses some
    for (int k = 0; k < 4; ++k) {
      auto next = opened->source->next(std::chrono::milliseconds(25));
      if (next.state != SourceState::kFrame || !next.frame.right.valid) continue;
      frames.push_back(std::move(next.frame));
    }
  }
  ASSERT_GE(frames.size(), 8U);
  for (const StereoFrame& frame : frames) EXPECT_EQ(apart(frame), 0);
  EXPECT_GT(opened->source->report().pairs.unpaired_left, 0U);
}

TEST_F(GigeSimulatorTest, WhatACameraDoesNotTakeIsSaid) {
  GigeSimulator left(without_ptp("LEFT"));
  GigeSimulator right(without_ptp("RIGHT"));
  ASSERT_TRUE(left.is_running() && right.is_running());
  const auto error_with = [this](const std::string& feature) {
    options_.features = {feature};
    const auto opened = open(kSimWidth, kSimHeight);
    return opened ? std::string("opened") : opened.error();
  };
  EXPECT_TRUE(contains(error_with("Gain=40"), "LEFT: Gain=40: the camera made it 10"));
  EXPECT_TRUE(contains(error_with("Gian=1"), "no feature Gian"));
  EXPECT_TRUE(contains(error_with("TriggerMode=Perhaps"), "it may be: Off On"));
  EXPECT_TRUE(contains(error_with("Gain=loud"), "it must be a number"));
  options_.features.clear();
  const auto large = open(2 * kSimWidth, kSimHeight);
  ASSERT_FALSE(large);
  EXPECT_TRUE(contains(large.error(), "320x120")) << large.error();
  options_.pixel_format = "RGB8";
  const auto colour = open(kSimWidth, kSimHeight);
  ASSERT_FALSE(colour);
  EXPECT_TRUE(contains(colour.error(), "RGB8 cannot be read")) << colour.error();
  options_.pixel_format = "Mono8";
  options_.sync = aravis::Sync::kPtp;
  const auto ptp = open(kSimWidth, kSimHeight);
  ASSERT_FALSE(ptp);
  EXPECT_TRUE(contains(ptp.error(), "cannot be synchronized by ptp")) << ptp.error();
}

TEST_F(GigeSimulatorTest, ACameraThatIsNotThereIsWaitedFor) {
  GigeSimulator left(without_ptp("LEFT"));
  GigeSimulator right(without_ptp("RIGHT"));
  ASSERT_TRUE(left.is_running() && right.is_running());
  right.unplug();
  options_.frame_rate = 5.0;
  auto opened = open(kSimWidth, kSimHeight);
  ASSERT_TRUE(opened) << opened.error();
  ASSERT_EQ(opened->notes.size(), 1U);
  EXPECT_TRUE(contains(opened->notes[0], "no GigE Vision camera is 'RIGHT'"));
  const LiveReport waiting = report_when(opened->source.get(), [](const LiveReport& r) {
    return contains(r.cameras[0].message, "waiting for the other camera");
  });
  EXPECT_TRUE(contains(waiting.cameras[0].message, "waiting for the other camera"));
  right.plug();
  EXPECT_EQ(take(opened->source.get(), 2).size(), 2U);
}

}  // namespace
}  // namespace sovo::gige
