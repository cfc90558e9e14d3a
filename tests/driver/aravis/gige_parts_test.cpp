#include <gtest/gtest.h>

#include <random>

#include "io/io_test_support.h"
#include "sovo/driver/aravis/aravis_source.h"
#include "sovo/driver/aravis/frame_gaps.h"
#include "sovo/driver/aravis/gige_network.h"
#include "sovo/driver/aravis/grey_image.h"
#include "sovo/driver/aravis/gvcp.h"
#include "sovo/driver/aravis/periodic_trigger.h"
#include "sovo/driver/aravis/sync_choice.h"

namespace sovo::aravis {
namespace {

using Bytes = std::vector<std::uint8_t>;

std::vector<int> grey16(SensorFormat format, const Bytes& bytes, int width, int height) {
  Bytes grey(static_cast<std::size_t>(2 * width * height));
  GreyReader reader;
  if (!reader.read(format, bytes, width, height, grey.data())) return {};
  std::vector<int> values;
  for (std::size_t i = 0; i < grey.size(); i += 2) values.push_back(grey[i] | grey[i + 1] << 8);
  return values;
}

TEST(Gvcp, AScheduledActionHasTheBytesOfTheStandard) {
  const auto packet =
      action_command(0x1234, {0x11223344, 0x55667788, 0x99aabbcc}, 0x0102030405060708);
  const std::array<std::uint8_t, 28> wanted = {
      0x42, 0x81,              // a command; scheduled, to be acknowledged
      0x01, 0x00,              // ACTION_CMD
      0x00, 0x14,              // 20 bytes follow the head
      0x12, 0x34,              // number of the request
      0x11, 0x22, 0x33, 0x44,  // device key
      0x55, 0x66, 0x77, 0x88,  // group key
      0x99, 0xaa, 0xbb, 0xcc,  // group mask
      0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x07, 0x08};
  EXPECT_EQ(packet, wanted);
}

TEST(Gvcp, ReadsARegister) {
  const std::array<std::uint8_t, 12> wanted = {0x42, 0x01, 0x00, 0x80, 0x00, 0x04,
                                               0x00, 0x07, 0x00, 0x00, 0x0a, 0x00};
  EXPECT_EQ(read_register_command(7, 0x0a00), wanted);
}

TEST(Gvcp, AnswersAreReadAndNonsenseIsNot) {
  const Bytes late = {0x80, 0x16, 0x01, 0x01, 0x00, 0x00, 0x00, 0x09};
  const auto ack = read_ack(late);
  ASSERT_TRUE(ack);
  EXPECT_EQ(ack->status, 0x8016);
  EXPECT_EQ(ack->command, 0x0101);
  EXPECT_EQ(ack->id, 9);
  std::mt19937 random(3);
  for (int i = 0; i < 20'000; ++i) {
    Bytes packet(random() % 40);
    for (auto& byte : packet) byte = static_cast<std::uint8_t>(random());
    const auto read = read_ack(packet);
    if (read) {
      EXPECT_EQ(read->command % 2, 1);
      EXPECT_GE(packet.size(), 8U);
    }
  }
}

TEST(GreyImage, SixteenBitFormatsComeToFullScale) {
  EXPECT_EQ(grey16(SensorFormat::kMono10, {0xff, 0x03, 0, 0, 1, 0, 0, 2}, 2, 2),
            (std::vector<int>{0xffc0, 0, 0x40, 0x8000}));
  EXPECT_EQ(grey16(SensorFormat::kMono12, {0xff, 0x0f, 0, 0, 1, 0, 0, 8}, 2, 2),
            (std::vector<int>{0xfff0, 0, 0x10, 0x8000}));
  EXPECT_EQ(grey16(SensorFormat::kMono16, {0x34, 0x12, 0, 0, 1, 0, 0, 0xff}, 2, 2),
            (std::vector<int>{0x1234, 0, 1, 0xff00}));
}

TEST(GreyImage, PackedFormatsAreUnpacked) {
  // Pixels 0xabc, 0x123, 0xfff, 0x001.
  EXPECT_EQ(grey16(SensorFormat::kMono12p, {0xbc, 0x3a, 0x12, 0xff, 0x1f, 0x00}, 2, 2),
            (std::vector<int>{0xabc0, 0x1230, 0xfff0, 0x0010}));
  EXPECT_EQ(grey16(SensorFormat::kMono12Packed, {0xab, 0x3c, 0x12, 0xff, 0x1f, 0x00}, 2, 2),
            (std::vector<int>{0xabc0, 0x1230, 0xfff0, 0x0010}));
  // Pixels 0x2bc, 0x123, 0x3ff, 0x001.
  EXPECT_EQ(grey16(SensorFormat::kMono10p, {0xbc, 0x8e, 0xf4, 0x7f, 0x00}, 2, 2),
            (std::vector<int>{0x2bc << 6, 0x123 << 6, 0x3ff << 6, 1 << 6}));
  EXPECT_EQ(grey16(SensorFormat::kMono10Packed, {0xaf, 0x30, 0x48, 0xff, 0x13, 0x00}, 2, 2),
            (std::vector<int>{0x2bc << 6, 0x123 << 6, 0x3ff << 6, 1 << 6}));
}

TEST(GreyImage, ABayerPatternOfOneColourIsFlat) {
  constexpr int kSize = 6;
  Bytes bayer(kSize * kSize);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const bool green = (x + y) % 2 == 1;
      bayer[static_cast<std::size_t>(y * kSize + x)] =
          static_cast<std::uint8_t>(green ? 100 : (y % 2 == 0 ? 200 : 40));
    }
  }
  Bytes grey(bayer.size());
  GreyReader reader;
  ASSERT_TRUE(reader.read(SensorFormat::kBayer8, bayer, kSize, kSize, grey.data()));
  for (const int value : grey) EXPECT_EQ(value, 110);  // (200 + 2 * 100 + 40) / 4
}

TEST(GreyImage, TooFewBytesAreRefusedByEveryFormat) {
  for (int format = 0; format <= static_cast<int>(SensorFormat::kBayer8); ++format) {
    const auto sensor = static_cast<SensorFormat>(format);
    for (const int pixels : {5 * 3, 4 * 4}) {
      const int width = pixels == 15 ? 5 : 4;
      const int height = pixels / width;
      const auto size = static_cast<std::size_t>((pixels * bits_per_pixel(sensor) + 7) / 8);
      Bytes grey(static_cast<std::size_t>(2 * pixels));
      GreyReader reader;
      EXPECT_FALSE(reader.read(sensor, Bytes(size - 1), width, height, grey.data())) << format;
      EXPECT_TRUE(reader.read(sensor, Bytes(size + 1), width, height, grey.data())) << format;
    }
  }
}

TEST(FrameGaps, CountsOverTheWrap) {
  FrameGaps gaps;
  EXPECT_EQ(gaps.before(65'533), 0U);
  EXPECT_EQ(gaps.before(65'534), 0U);
  EXPECT_EQ(gaps.before(1), 1U);  // 65535 is missing
  EXPECT_EQ(gaps.before(5), 3U);
  EXPECT_EQ(gaps.before(2), 0U);  // began anew
  FrameGaps wide;
  EXPECT_EQ(wide.before(std::uint64_t{1} << 40U), 0U);
  EXPECT_EQ(wide.before((std::uint64_t{1} << 40U) + 2), 1U);
}

TEST(TriggerGrid, GivesEveryInstantOnceAndInTime) {
  const TriggerGrid grid{100, 40};
  EXPECT_EQ(grid.next(1'010, 0), 1'100);
  EXPECT_EQ(grid.next(1'060, 1'100), 1'200);
  EXPECT_EQ(grid.next(1'059, 1'100), 1'200);  // woken a little early
  EXPECT_EQ(grid.next(1'070, 1'100), 1'200);
}

TEST(GigeNetwork, PacketsFitTheInterface) {
  EXPECT_EQ(fit_packet_size(0, 1500), 1500);
  EXPECT_EQ(fit_packet_size(0, 9000), 8192);
  EXPECT_EQ(fit_packet_size(9000, 1500), 1500);
  EXPECT_EQ(fit_packet_size(1402, 1500), 1400);
  EXPECT_EQ(fit_packet_size(100, 1500), 576);
  EXPECT_LT(2 * port_share(1000), 1000);
}

TEST(GigeNetwork, FindsTheInterfaceOfAnAddress) {
  EXPECT_EQ(find_interface("127.0.0.1").name, "lo");
  EXPECT_GT(find_interface("127.0.0.1").mtu, 1500);
  EXPECT_EQ(find_interface("not an address").name, "");
}

TEST(GigeNetwork, ACameraIsFoundBySerialAndAddress) {
  const std::vector<GigeInfo> cameras = {{"a-1", "A", "1", "10.0.0.1", "eth0"},
                                         {"a-2", "A", "2", "10.0.0.2", "eth0"}};
  EXPECT_EQ(find_camera(cameras, "2")->address, "10.0.0.2");
  EXPECT_EQ(find_camera(cameras, "10.0.0.1")->serial, "1");
  EXPECT_TRUE(contains(find_camera(cameras, "3").error(), "1 at 10.0.0.1, 2 at 10.0.0.2"));
  EXPECT_TRUE(contains(find_camera({}, "3").error(), "none answers"));
}

TEST(SyncChoice, TakesTheBestThatBothCan) {
  const SyncAbility all{true, true, true, true};
  const SyncAbility ptp{false, true, false, true};
  const SyncAbility none{};
  EXPECT_EQ(best_sync(all, all, true), Sync::kHardware);
  EXPECT_EQ(best_sync(all, all, false), Sync::kAction);
  EXPECT_EQ(best_sync(all, ptp, true), Sync::kPtp);
  EXPECT_EQ(best_sync({false, false, true, true}, ptp, false), Sync::kSoftware);
  EXPECT_EQ(best_sync(all, none, true), Sync::kFree);
}

TEST(SyncChoice, AutoWaitsForBothAndThenStays) {
  SyncChoice choice(Sync::kAuto, false);
  const SyncAbility ptp{false, true, false, false};
  EXPECT_TRUE(contains(choice.choose(CameraSide::kLeft, ptp).error(), "waiting for the other"));
  EXPECT_EQ(*choice.choose(CameraSide::kRight, ptp), Sync::kPtp);
  EXPECT_EQ(*choice.choose(CameraSide::kLeft, ptp), Sync::kPtp);
  EXPECT_TRUE(contains(choice.choose(CameraSide::kLeft, {}).error(), "cannot be synchronized"));
  SyncChoice named(Sync::kHardware, false);
  EXPECT_TRUE(contains(named.choose(CameraSide::kLeft, ptp).error(), "trigger_source"));
}

TEST(AravisOptions, NonsenseIsRefused) {
  const LiveOptions live;
  AravisOptions good;
  good.left = "1";
  good.right = "2";
  EXPECT_TRUE(check_options(good, live));
  AravisOptions bad = good;
  bad.right = "1";
  EXPECT_FALSE(check_options(bad, live));
  bad = good;
  bad.features = {"Gain"};
  EXPECT_TRUE(contains(check_options(bad, live).error(), "Name=value"));
  bad = good;
  bad.buffers = 1;
  EXPECT_FALSE(check_options(bad, live));
  bad = good;
  bad.frame_rate = -1.0;
  EXPECT_FALSE(check_options(bad, live));
}

}  // namespace
}  // namespace sovo::aravis
