#include "sovo/driver/v4l2/zed_controls.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

namespace sovo::v4l2 {
namespace {

/// The registers of a ZED as its extension shows them.
class FakeZed : public ExtensionUnit {
 public:
  explicit FakeZed(std::size_t size) : size_(size) {
    bridge[0x80181033] = 0x83;
    bridge[0x80181833] = 0x83;
  }

  Result<std::size_t> message_size() override { return size_; }

  Result<void> send(std::span<std::uint8_t> message) override {
    if (unplugged) return Error{"no such device"};
    EXPECT_EQ(message.size(), size_);
    const std::uint32_t address =
        message[5] * 0x1000000U + message[6] * 0x10000U + message[7] * 0x100U + message[8];
    std::map<std::uint32_t, std::uint8_t>& registers = registers_of(message);
    EXPECT_EQ(message[4], 1);
    EXPECT_EQ(message[12], 1);
    if (message[0] == 0x50 && !read_only) registers[address] = message[16];
    answer_ = registers[address];
    return {};
  }

  Result<void> receive(std::span<std::uint8_t> message) override {
    message[17] = answer_;
    return {};
  }

  std::map<std::uint32_t, std::uint8_t> bridge, left, right;
  bool read_only = false;
  bool unplugged = false;

 private:
  std::map<std::uint32_t, std::uint8_t>& registers_of(std::span<const std::uint8_t> message) {
    if (message[1] == 0xA2) {
      EXPECT_EQ(message[3], 4);
      return bridge;
    }
    EXPECT_EQ(message[2], 0x6c);
    EXPECT_EQ(message[3], 2);
    EXPECT_EQ(message[9], 0x90);
    return message[1] == 0xA3 ? left : right;
  }

  std::size_t size_;
  std::uint8_t answer_ = 0;
};

int exposure_rows(std::map<std::uint32_t, std::uint8_t>& sensor) {
  return ((sensor[0x3500] << 16) + (sensor[0x3501] << 8) + sensor[0x3502]) >> 4;
}

int gain_of(std::map<std::uint32_t, std::uint8_t>& sensor) {
  return (sensor[0x3507] << 16) + (sensor[0x3508] << 8) + sensor[0x3509];
}

TEST(ZedControls, BothSensorsGetTheExposureAndTheAutomaticOneEnds) {
  for (const std::size_t size : {64U, 384U}) {  // USB 2 and 3
    FakeZed zed(size);
    ZedControls controls(&zed, 30.0);
    ASSERT_TRUE(apply_zed_controls(&controls, {{"zed_exposure", 50}, {"zed_gain", 100}}).ok());
    EXPECT_EQ(exposure_rows(zed.left), 550);
    EXPECT_EQ(exposure_rows(zed.right), 550);
    EXPECT_EQ(gain_of(zed.left), 2047);
    EXPECT_EQ(gain_of(zed.right), 2047);
    EXPECT_EQ(zed.bridge[0x80181033], 0x81);  // one bit of the register is ours
    EXPECT_EQ(zed.bridge[0x80181833], 0x81);
    ASSERT_TRUE(apply_zed_controls(&controls, {{"zed_auto_exposure", 1}}).ok());
    EXPECT_EQ(zed.bridge[0x80181033], 0x83);
    EXPECT_EQ(zed.bridge[0x80181833], 0x83);
  }
}

TEST(ZedControls, TheFrameRateLimitsTheExposure) {
  FakeZed zed(384);
  for (const auto& [rate, rows] :
       std::map<double, int>{{15, 1550}, {30, 1100}, {60, 880}, {100, 720}}) {
    EXPECT_EQ(ZedControls::longest_exposure(rate), rows);
    ZedControls controls(&zed, rate);
    ASSERT_TRUE(controls.set_exposure(100).ok());
    EXPECT_EQ(exposure_rows(zed.right), rows);
    ASSERT_TRUE(controls.set_exposure(0).ok());
    EXPECT_EQ(exposure_rows(zed.right), 2);
  }
}

TEST(ZedControls, GainRisesThroughAllRanges) {
  EXPECT_EQ(ZedControls::gain_register(0), 0);
  for (int percent = 1; percent <= 100; ++percent) {
    const int value = ZedControls::gain_register(percent);
    EXPECT_GT(value, ZedControls::gain_register(percent - 1));
    const bool known = value <= 255 || (value >= 378 && value <= 511) ||
                       (value >= 890 && value <= 1023) || (value >= 1914 && value <= 2047);
    EXPECT_TRUE(known) << value;
  }
}

TEST(ZedControls, WhatCannotBeIsSaid) {
  FakeZed zed(384);
  ZedControls controls(&zed, 30.0);
  const auto error_of = [&](const ControlSetting& s) {
    return apply_zed_controls(&controls, {s}).error();
  };
  EXPECT_EQ(error_of({"zed_exposure", 101}), "zed_exposure=101: must be 0 to 100");
  EXPECT_EQ(error_of({"zed_gain", -5'000'000'000}), "zed_gain=-5000000000: must be 0 to 100");
  EXPECT_EQ(error_of({"zed_auto_exposure", 2}), "zed_auto_exposure=2: must be 0 or 1");
  EXPECT_TRUE(zed.left.empty());
  zed.read_only = true;
  EXPECT_NE(error_of({"zed_exposure", 50}).find("the camera made it"), std::string::npos);
  zed.unplugged = true;
  EXPECT_NE(error_of({"zed_gain", 50}).find("no such device"), std::string::npos);
  FakeZed other(8);
  ZedControls none(&other, 30.0);
  EXPECT_NE(none.set_gain(3).error().find("8 bytes"), std::string::npos);
}

TEST(ZedControls, OnlyItsOwnNamesAreTaken) {
  EXPECT_TRUE(is_zed_control({"zed_gain", 1}));
  EXPECT_FALSE(is_zed_control({"gain", 1}));
}

}  // namespace
}  // namespace sovo::v4l2
