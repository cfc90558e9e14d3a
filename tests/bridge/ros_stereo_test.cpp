#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "sovo/bridge/borrow.h"
#include "sovo/bridge/camera_info_conversion.h"
#include "sovo/bridge/camera_publisher.h"
#include "sovo/bridge/image_conversion.h"
#include "sovo/bridge/ros_conversion.h"
#include "sovo/bridge/ros_stereo_subscriber.h"
#include "sovo/bridge/stereo_frame_conversion.h"
#include "sovo/bridge/stereo_pairing.h"
#include "sovo/bridge/topic_discovery.h"
#include "sovo/bridge/topics.h"
#include "test_bus.h"
#include "test_cameras.h"

namespace sovo::bridge {
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t kMs = 1'000'000;

SideImage image_of(int id) {
  SideImage side;
  side.valid = true;
  side.width = id;
  return side;
}

TEST(StereoPairing, EqualStampsBelongTogetherWhateverTheirOrder) {
  StereoPairing pairing(0);
  pairing.add_right({100, image_of(1), ""});
  EXPECT_FALSE(pairing.next());
  pairing.add_left({100, image_of(2), "left"});
  const auto frame = pairing.next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->left.width, 2);
  EXPECT_EQ(frame->right.width, 1);
  EXPECT_EQ(frame->frame_id, "left");
  EXPECT_EQ(frame->pair_error_s, 0.0);
  EXPECT_FALSE(pairing.next());
  EXPECT_EQ(pairing.unpaired(), 0U);
}

TEST(StereoPairing, CloseStampsArePairedAndTheirDistanceTold) {
  StereoPairing pairing(5 * kMs);
  pairing.add_left({100 * kMs, image_of(1), ""});
  pairing.add_right({103 * kMs, image_of(2), ""});
  const auto frame = pairing.next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->stamp_ns, 100 * kMs);
  EXPECT_NEAR(frame->pair_error_s, 0.003, 1e-12);
  EXPECT_EQ(frame->right.stamp_offset_ns, 3 * kMs);
}

TEST(StereoPairing, ImagesWithoutAPartnerAreCountedAndTheLeftOnesTracked) {
  StereoPairing pairing(kMs);
  pairing.add_right({50 * kMs, image_of(9), ""});
  pairing.add_left({100 * kMs, image_of(1), ""});
  pairing.add_left({150 * kMs, image_of(2), ""});
  pairing.add_right({150 * kMs, image_of(3), ""});
  const auto alone = pairing.next();
  ASSERT_TRUE(alone);
  EXPECT_EQ(alone->stamp_ns, 100 * kMs);
  EXPECT_FALSE(alone->right.valid);
  const auto pair = pairing.next();
  ASSERT_TRUE(pair);
  EXPECT_EQ(pair->right.width, 3);
  EXPECT_EQ(pairing.unpaired(), 2U);
}

TEST(StereoPairing, ADeadRightCameraLeavesTheLeftOne) {
  StereoPairing pairing(kMs);
  int alone = 0;
  for (int i = 0; i < 10; ++i) {
    pairing.add_left({i * 50 * kMs, image_of(1), ""});
    while (const auto frame = pairing.next()) {
      EXPECT_FALSE(frame->right.valid);
      ++alone;
    }
  }
  EXPECT_EQ(alone, 7);
}

TEST(StereoPairing, ARecordingThatBeginsAgainIsPairedAgain) {
  StereoPairing pairing(kMs);
  pairing.add_left({900 * kMs, image_of(1), ""});
  pairing.add_left({100 * kMs, image_of(2), ""});
  pairing.add_right({100 * kMs, image_of(3), ""});
  const auto frame = pairing.next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->left.width, 2);
}

CameraInfoCopy info_of(const StereoRig& rig, bool is_left) {
  CameraInfoMessage message(rig, rectify(rig), is_left, "camera");
  return copy(message.at(0));
}

TEST(CameraInfo, GivesTheRigBackThatItWasMadeOf) {
  const StereoRig rig = test_cameras().rig;
  const auto cameras = cameras_from(info_of(rig, true), info_of(rig, false), false);
  ASSERT_TRUE(cameras.ok()) << cameras.error();
  EXPECT_EQ(cameras->rig.left.fx, rig.left.fx);
  EXPECT_EQ(cameras->rig.right.distortion, Distortion::kEquidistant);
  EXPECT_EQ(cameras->rig.left.d[1], rig.left.d[1]);
  EXPECT_TRUE(cameras->rig.T_right_left.matrix().isApprox(rig.T_right_left.matrix(), 1e-9));
}

TEST(CameraInfo, OfRectifiedImagesIsAPairOfPinholes) {
  const StereoRig rig = test_cameras().rig;
  const auto cameras = cameras_from(info_of(rig, true), info_of(rig, false), true);
  ASSERT_TRUE(cameras.ok()) << cameras.error();
  EXPECT_EQ(cameras->rig.left.distortion, Distortion::kNone);
  EXPECT_EQ(cameras->rig.left.fx, cameras->rig.right.fx);
  EXPECT_TRUE(
      cameras->rig.T_right_left.translation().isApprox(Vec3(-rig.baseline(), 0.0, 0.0), 1e-9));
}

TEST(CameraInfo, WhatCannotBeIsRefusedWithAReason) {
  const StereoRig rig = test_cameras().rig;
  const CameraInfoCopy left = info_of(rig, true);
  const CameraInfoCopy right = info_of(rig, false);
  const auto error = [&](const CameraInfoCopy& l, const CameraInfoCopy& r) {
    const auto cameras = cameras_from(l, r, false);
    return cameras.ok() ? std::string() : cameras.error();
  };
  CameraInfoCopy broken = left;
  broken.k = {};
  EXPECT_NE(error(broken, right).find("not calibrated"), std::string::npos);
  broken = left;
  broken.k[0] = std::nan("");
  EXPECT_NE(error(broken, right).find("left"), std::string::npos);
  broken = right;
  broken.p[3] = 0.0;
  EXPECT_NE(error(left, broken).find("baseline"), std::string::npos);
  broken = right;
  broken.r = {};
  EXPECT_NE(error(left, broken).find("right.r"), std::string::npos);
  broken = right;
  broken.d = {1.0};
  EXPECT_NE(error(left, broken).find("right.d"), std::string::npos);
}

TEST(RosImage, BayerPatternsBecomeGreyWithoutAShift) {
  // Every pattern of an evenly coloured wall: R = 200, G = 100, B = 40.
  constexpr int kSize = 6;
  for (const char* pattern : {"bayer_rggb8", "bayer_bggr8", "bayer_gbrg8", "bayer_grbg8"}) {
    std::vector<std::uint8_t> data;
    for (int y = 0; y < kSize; ++y) {
      for (int x = 0; x < kSize; ++x) {
        const char colour = pattern[6 + 2 * (y % 2) + x % 2];
        data.push_back(colour == 'r' ? 200 : colour == 'g' ? 100 : 40);
      }
    }
    msg::Image image{};
    image.width = image.height = image.step = kSize;
    image.encoding = borrow(pattern);
    borrow(image.data, data);
    const auto side = from_message(image, "left");
    ASSERT_TRUE(side.ok()) << side.error();
    for (const std::uint8_t grey : *side->data) EXPECT_EQ(grey, 110) << pattern;
  }
}

TEST(RosImage, BigEndianSixteenBitsAreTurned) {
  std::vector<std::uint8_t> data = {0x12, 0x34, 0x56, 0x78, 0xFF};
  msg::Image image{};
  image.width = 2;
  image.height = 1;
  image.step = 5;
  image.is_bigendian = 1;
  image.encoding = borrow("mono16");
  borrow(image.data, data);
  const auto side = from_message(image, "left");
  ASSERT_TRUE(side.ok()) << side.error();
  EXPECT_EQ(*side->data, (std::vector<std::uint8_t>{0x34, 0x12, 0x78, 0x56, 0xFF}));
}

/// Whatever a header says, an image is refused or read within its bounds (the sanitizers watch).
TEST(RosImage, RandomHeadersAreSurvived) {
  std::mt19937 random(7);
  const auto number = [&](std::uint32_t most) {
    return static_cast<std::uint32_t>(random()) % most;
  };
  const char* encodings[] = {"mono8", "mono16", "rgb8", "bayer_rggb8", "yuv422_yuy2", "jpeg", ""};
  int accepted = 0;
  for (int i = 0; i < 2000; ++i) {
    std::vector<std::uint8_t> data(number(64));
    msg::Image image{};
    image.width = number(9);
    image.height = number(9);
    image.step = number(4) == 0 ? 0xFFFFFFFFU - number(9) : number(20);
    image.encoding = borrow(encodings[number(7)]);
    image.is_bigendian = static_cast<std::uint8_t>(number(2));
    if (number(2) == 0) data.resize(std::size_t{image.height} * number(20));
    borrow(image.data, data);
    if (number(8) == 0) image.encoding = nullptr;
    const auto side = from_message(image, "left");
    if (!side) continue;
    ++accepted;
    EXPECT_EQ(side->data->size(), static_cast<std::size_t>(side->step) * side->height);
  }
  EXPECT_GT(accepted, 0);
}

/// A driver that publishes what our camera process shows of a frame.
struct Driver {
  Participant participant = open_remote_participant();
  CameraPublisher publisher = require(CameraPublisher::open(participant, test_cameras(), 0));
  std::uint64_t sequence = 0;
  void publish() { EXPECT_TRUE(publisher.publish(test_frame(++sequence)).ok()); }
};

TEST(RosStereoSubscriber, TakesImagesAndCalibrationOfADriver) {
  Driver driver;
  const Participant vo = open_participant();
  auto source =
      require(RosStereoSubscriber::open(vo, {"/sovo/left/image_raw", "/sovo/right/image_raw"}));
  EXPECT_TRUE(eventually([&] {
    driver.publish();
    return source->wait_for_calibration(20ms).ok();
  }));
  EXPECT_EQ(source->rig().left.fx, test_cameras().rig.left.fx);
  EXPECT_NEAR(source->rig().baseline(), test_cameras().rig.baseline(), 1e-9);
  SourceResult result;
  EXPECT_TRUE(eventually([&] {
    driver.publish();
    result = source->next(20ms);
    return result.state == SourceState::kFrame && result.frame.right.valid;
  }));
  const StereoFrame sent = test_frame(1);
  EXPECT_EQ(*result.frame.left.data, *sent.left.data);
  EXPECT_EQ(*result.frame.right.data, *sent.right.data);
  EXPECT_EQ((result.frame.stamp_ns - sent.stamp_ns) % (50 * kMs), 0);
  EXPECT_EQ(result.frame.frame_id, "cam_left_camera_optical_frame");
  EXPECT_GT(source->counters().received, 0U);
}

TEST(RosStereoSubscriber, SaysWhatIsMissing) {
  const Participant vo = open_participant();
  auto source = require(RosStereoSubscriber::open(vo, {"/no/left/image", "/no/right/image"}));
  std::string error;
  EXPECT_TRUE(eventually([&] {
    error = source->wait_for_calibration(20ms).error();
    return error.find("no images on /no/right/image") != std::string::npos;
  })) << error;
  EXPECT_NE(error.find("/no/left/camera_info"), std::string::npos) << error;
  const auto compressed =
      RosStereoSubscriber::open(vo, {"/a/image_raw/compressed", "/b/image_raw/compressed"});
  ASSERT_FALSE(compressed.ok());
}

TEST(RosStereoSubscriber, ImagesThatCannotBeUsedAreReportedOnceAndCounted) {
  const Participant camera = open_remote_participant();
  const Participant vo = open_participant();
  auto source = require(
      RosStereoSubscriber::open(vo, {"/cam/left/image", "/cam/right/image"}, test_cameras()));
  auto writer = require(Writer<msg::Image>::open(camera, "/cam/left/image", reliable(4)));
  msg::Image image{};
  image.encoding = borrow("16UC3");
  image.header.frame_id = borrow("");
  EXPECT_TRUE(eventually([&] {
    EXPECT_TRUE(writer.write(image).ok());
    return source->counters().rejected > 3;
  }));
  const SourceResult report = source->next(0ms);
  EXPECT_EQ(report.state, SourceState::kBadFrame);
  EXPECT_NE(report.message.find("'16UC3'"), std::string::npos) << report.message;
  EXPECT_EQ(source->next(0ms).state, SourceState::kTimeout);
}

TEST(TopicDiscovery, ListsWhatOthersWrite) {
  const Participant other = open_remote_participant();
  const Participant self = open_participant();
  const auto writer = require(Writer<msg::VoStatus>::open(other, topics::kStatus, reliable(10)));
  const auto own = require(Writer<msg::VoCommand>::open(self, topics::kCommand, reliable(10)));
  const auto discovery = require(TopicDiscovery::open(self));
  std::vector<DiscoveredTopic> found;
  EXPECT_TRUE(eventually([&] {
    found = require(discovery.topics());
    return !found.empty();
  }));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].name, "/sovo/status");
  EXPECT_EQ(found[0].type, "sovo_msgs/msg/VoStatus");
  EXPECT_EQ(found[0].writers, 1);
  EXPECT_FALSE(found[0].qos.latched);
  EXPECT_FALSE(found[0].qos.best_effort);
}

}  // namespace
}  // namespace sovo::bridge
