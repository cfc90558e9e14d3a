#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "sovo/bridge/borrow.h"
#include "sovo/bridge/camera_publisher.h"
#include "sovo/bridge/message_schema.h"
#include "sovo/bridge/raw_reader.h"
#include "sovo/bridge/raw_writer.h"
#include "sovo/bridge/stereo_frame_conversion.h"
#include "sovo/bridge/stereo_subscriber.h"
#include "sovo/bridge/topics.h"
#include "test_bus.h"
#include "test_cameras.h"

namespace sovo::bridge {
namespace {

using namespace std::chrono_literals;

/// A camera, and the odometry's feed of it on the other side of the network.
struct Feed {
  Participant vo = open_participant();
  Participant camera = open_remote_participant();
  std::unique_ptr<StereoSubscriber> source =
      require(StereoSubscriber::open(vo, {4}, test_cameras()));
  CameraPublisher publisher = require(CameraPublisher::open(camera, test_cameras(), 0));

  Feed() {
    EXPECT_TRUE(eventually([&] { return publisher.num_readers() > 0; }));
  }

  /// Publishes a frame and waits until it is given out; reports before it are passed over.
  bool passes(std::uint64_t sequence) {
    EXPECT_TRUE(publisher.publish(test_frame(sequence)).ok());
    return eventually([&] {
      const SourceResult result = source->next(100ms);
      return result.state == SourceState::kFrame && result.frame.sequence == sequence;
    });
  }
};

TEST(Robustness, ASubscriberThatNeverReadsCostsTheOthersNothing) {
  Feed feed;
  const Participant third = open_participant();
  const auto lazy =
      require(Reader<msg::StereoFrame>::open(third, topics::kStereo, topics::kStereoQos));
  ASSERT_TRUE(eventually([&] { return feed.publisher.num_readers() >= 2; }));
  for (std::uint64_t sequence = 1; sequence <= 40; ++sequence) {
    ASSERT_TRUE(feed.passes(sequence));
  }
  EXPECT_EQ(feed.source->counters().received, 40U);
  EXPECT_EQ(feed.source->counters().lost_transport, 0U);
}

TEST(Robustness, MutatedFramesAreRefusedAndCounted) {
  Feed feed;
  auto writer =
      require(Writer<msg::StereoFrame>::open(feed.camera, topics::kStereo, topics::kStereoQos));
  ASSERT_TRUE(eventually([&] { return writer.num_readers() > 0; }));
  ASSERT_TRUE(feed.passes(1));
  std::mt19937 random(11);
  const StereoFrame frame = test_frame(2);
  std::uint64_t refused = 0;
  for (int i = 0; i < 40; ++i) {
    msg::StereoFrame m = to_message(frame);
    msg::SideImage& side = random() % 2 == 0 ? m.left : m.right;
    switch (i % 8) {
      case 0:
        side.width = 0xFFFFFFFFU - static_cast<std::uint32_t>(random() % 8);
        break;
      case 1:
        side.height = static_cast<std::uint32_t>(random());
        break;
      case 2:
        side.step = side.width - 1;
        break;
      case 3:
        side.encoding = borrow("%s%n");
        break;
      case 4:
        side.exposure_s = std::numeric_limits<float>::quiet_NaN();
        break;
      case 5:
        m.pair_error_s = std::numeric_limits<double>::infinity();
        break;
      case 6:
        m.header.stamp.nanosec = 2'000'000'000U;
        break;
      default:
        side.data._length -= static_cast<std::uint32_t>(1 + random() % 1000);
        break;
    }
    ASSERT_TRUE(writer.write(m).ok());
    ++refused;
    ASSERT_TRUE(eventually([&] { return feed.source->counters().rejected == refused; })) << i;
  }
  EXPECT_TRUE(feed.passes(3));
  EXPECT_EQ(feed.source->counters().foreign, 0U);
}

/// Bytes that are no message at all: the middleware throws them away, and the feed lives on.
TEST(Robustness, SerializedGarbageIsSurvived) {
  Feed feed;
  ASSERT_TRUE(feed.passes(1));
  auto raw = require(RawReader::open(feed.camera, topics::kStereo,
                                     *find_schema("sovo_msgs/msg/StereoFrame"), reliable(4)));
  std::vector<std::uint8_t> good;
  ASSERT_TRUE(eventually([&] {
    EXPECT_TRUE(feed.publisher.publish(test_frame(2)).ok());
    (void)raw.take_each([&](const CdrSample& sample, const dds_sample_info_t&) {
      good.assign(sample.bytes().begin(), sample.bytes().end());
    });
    return !good.empty();
  }));
  auto writer = require(RawWriter::open(feed.camera, topics::kStereo,
                                        *find_schema("sovo_msgs/msg/StereoFrame"), reliable(4)));
  ASSERT_TRUE(eventually([&] { return writer.num_readers() > 0; }));
  std::mt19937 random(5);
  for (int i = 0; i < 200; ++i) {
    std::vector<std::uint8_t> bytes = good;
    if (i % 4 == 0) bytes.resize(4 + random() % 200);
    // The fields before the pixels: lengths, sizes, texts.
    for (int k = 0; k < 3; ++k) {
      bytes[4 + random() % (std::min<std::size_t>(bytes.size(), 160) - 4)] =
          static_cast<std::uint8_t>(random());
    }
    EXPECT_TRUE(writer.write(bytes, dds_time()).ok());
  }
  // Another session may have come out of the garbage: what counts is that frames pass again.
  EXPECT_TRUE(feed.passes(1000));
}

TEST(Robustness, ACalibrationOfNansIsRefusedAndAGoodOneTaken) {
  const Participant vo = open_participant();
  const Participant camera = open_remote_participant();
  const auto source = require(StereoSubscriber::open(vo, {4}));
  {
    auto writer = require(Writer<msg::StereoCalibration>::open(camera, topics::kCalibration,
                                                               topics::kCalibrationQos));
    const CalibrationMessage good(test_cameras(), "left", 0);
    msg::StereoCalibration broken = good.message();
    broken.left.fx_fy_cx_cy[1] = std::numeric_limits<double>::quiet_NaN();
    ASSERT_TRUE(writer.write(broken).ok());
    std::string error;
    EXPECT_TRUE(eventually([&] {
      error = source->wait_for_calibration(20ms).error();
      return error.find("refused") != std::string::npos;
    }));
    EXPECT_NE(error.find("left.fx_fy_cx_cy"), std::string::npos) << error;
  }
  const auto publisher = require(CameraPublisher::open(camera, test_cameras(), 0));
  EXPECT_TRUE(eventually([&] { return source->wait_for_calibration(20ms).ok(); }));
}

}  // namespace
}  // namespace sovo::bridge
