#include "sovo/bridge/stereo_subscriber.h"

#include <gtest/gtest.h>

#include "sovo/bridge/borrow.h"
#include "sovo/bridge/camera_publisher.h"
#include "sovo/bridge/stereo_frame_conversion.h"
#include "sovo/bridge/topics.h"
#include "test_bus.h"
#include "test_cameras.h"

namespace sovo::bridge {
namespace {

using namespace std::chrono_literals;
constexpr auto kLong = 20000ms;

/// A camera and an odometry's feed that speak through sockets.
struct Pair {
  Participant vo = open_participant();
  Participant camera = open_remote_participant();
  std::unique_ptr<StereoSubscriber> source;
  std::optional<CameraPublisher> publisher;

  explicit Pair(int queue = 4) {
    source = require(StereoSubscriber::open(vo, {queue}));
    publisher = require(CameraPublisher::open(camera, test_cameras(), 0));
    EXPECT_TRUE(source->wait_for_calibration(kLong).ok());
    EXPECT_TRUE(eventually([&] { return publisher->num_readers() > 0; }));
  }

  void publish(std::uint64_t sequence) {
    const auto done = publisher->publish(test_frame(sequence));
    EXPECT_TRUE(done.ok()) << done.error();
  }
};

TEST(StereoSubscriber, FramesAndCalibrationArriveUnchanged) {
  Pair pair;
  EXPECT_EQ(pair.source->rig().left.fx, test_cameras().rig.left.fx);
  EXPECT_EQ(pair.source->cameras().left_photometric.inverse_response.size(), 256U);
  pair.publish(5);
  const SourceResult result = pair.source->next(kLong);
  ASSERT_EQ(result.state, SourceState::kFrame) << result.message;
  const StereoFrame sent = test_frame(5);
  EXPECT_EQ(result.frame.stamp_ns, sent.stamp_ns);
  EXPECT_EQ(result.frame.frame_id, "cam_left_camera_optical_frame");
  EXPECT_EQ(*result.frame.left.data, *sent.left.data);
  EXPECT_EQ(*result.frame.right.data, *sent.right.data);
  EXPECT_EQ(pair.source->latency_origin_ns(), sent.stamp_ns);
  EXPECT_EQ(pair.source->next(0ms).state, SourceState::kTimeout);
}

TEST(StereoSubscriber, GapsInTheSequenceAreCounted) {
  Pair pair;
  for (const std::uint64_t sequence : {1, 2, 5, 6, 8}) {
    pair.publish(sequence);
    ASSERT_EQ(pair.source->next(kLong).state, SourceState::kFrame);
  }
  const FeedCounters counters = pair.source->counters();
  EXPECT_EQ(counters.received, 5U);
  EXPECT_EQ(counters.lost_transport, 3U);
  EXPECT_EQ(counters.dropped_queue, 0U);
}

TEST(StereoSubscriber, ALateReaderGetsTheNewestFramesAndACount) {
  Pair pair(2);
  for (std::uint64_t sequence = 0; sequence < 5; ++sequence) {
    pair.publish(sequence);
    ASSERT_TRUE(eventually([&] { return pair.source->counters().received == sequence + 1; }));
  }
  EXPECT_EQ(pair.source->counters().dropped_queue, 3U);
  EXPECT_EQ(pair.source->next(0ms).frame.sequence, 3U);
  EXPECT_EQ(pair.source->next(0ms).frame.sequence, 4U);
}

TEST(StereoSubscriber, MalformedFramesAreReportedAndTheNextOnesTaken) {
  Pair pair;
  auto writer =
      require(Writer<msg::StereoFrame>::open(pair.camera, topics::kStereo, topics::kStereoQos));
  ASSERT_TRUE(eventually([&] { return writer.num_readers() > 0; }));
  const StereoFrame frame = test_frame(1);
  msg::StereoFrame message = to_message(frame);
  message.left.height += 1;
  ASSERT_TRUE(writer.write(message).ok());
  const SourceResult refused = pair.source->next(kLong);
  EXPECT_EQ(refused.state, SourceState::kBadFrame);
  EXPECT_NE(refused.message.find("left: data"), std::string::npos) << refused.message;
  pair.publish(2);
  EXPECT_EQ(pair.source->next(kLong).state, SourceState::kFrame);
  EXPECT_EQ(pair.source->counters().rejected, 1U);
}

TEST(StereoSubscriber, ASecondPublisherIsReportedOnceUntilTheFirstHasGone) {
  Pair pair;
  pair.publish(1);
  ASSERT_EQ(pair.source->next(kLong).state, SourceState::kFrame);

  const Participant intruder = open_participant();
  auto second = require(CameraPublisher::open(intruder, test_cameras(), 0));
  ASSERT_TRUE(eventually([&] { return second.num_readers() > 0; }));
  for (std::uint64_t sequence = 100; sequence < 103; ++sequence) {
    ASSERT_TRUE(second.publish(test_frame(sequence, 8)).ok());
  }
  const SourceResult report = pair.source->next(kLong);
  EXPECT_EQ(report.state, SourceState::kBadFrame);
  EXPECT_NE(report.message.find("second publisher"), std::string::npos) << report.message;
  ASSERT_TRUE(eventually([&] { return pair.source->counters().foreign == 3; }));
  pair.publish(2);
  EXPECT_EQ(pair.source->next(kLong).frame.sequence, 2U);

  pair.publisher.reset();
  SourceResult result;
  ASSERT_TRUE(eventually([&] {
    EXPECT_TRUE(second.publish(test_frame(110, 8)).ok());
    result = pair.source->next(50ms);
    return result.state == SourceState::kFrame;
  }));
  EXPECT_EQ(result.frame.session, 8U);
  EXPECT_EQ(pair.source->counters().lost_transport, 0U);
}

TEST(StereoSubscriber, AnotherCalibrationEndsTheStream) {
  Pair pair;
  pair.publish(1);
  ASSERT_EQ(pair.source->next(kLong).state, SourceState::kFrame);
  pair.publisher.reset();
  StereoCameras other = test_cameras();
  other.rig.left.fx += 1.0;
  const Participant next_camera = open_participant();
  auto publisher = require(CameraPublisher::open(next_camera, other, 0));
  SourceResult result;
  ASSERT_TRUE(eventually([&] {
    EXPECT_TRUE(publisher.publish(test_frame(1, 9)).ok());
    result = pair.source->next(50ms);
    return result.state == SourceState::kFailed;
  }));
  EXPECT_NE(result.message.find("calibration"), std::string::npos) << result.message;
}

TEST(StereoSubscriber, WithoutACameraItSaysWhatToDo) {
  const Participant participant = open_participant();
  auto source = require(StereoSubscriber::open(participant, {}));
  const auto found = source->wait_for_calibration(30ms);
  ASSERT_FALSE(found.ok());
  EXPECT_NE(found.error().find("/sovo/calibration"), std::string::npos) << found.error();
  source->wake();
  EXPECT_EQ(source->next(kLong).state, SourceState::kTimeout);
}

TEST(StereoSubscriber, AGivenCalibrationNeedsNoPublisher) {
  const Participant participant = open_participant();
  auto source = require(StereoSubscriber::open(participant, {}, test_cameras()));
  EXPECT_TRUE(source->wait_for_calibration(0ms).ok());
  EXPECT_EQ(source->rig().left.width, 752);
}

}  // namespace
}  // namespace sovo::bridge
