#include <gtest/gtest.h>

#include <numeric>
#include <optional>

#include "message_filler.h"
#include "sovo/bridge/raw_reader.h"
#include "sovo/bridge/raw_writer.h"
#include "sovo/bridge/reader.h"
#include "sovo/bridge/topic_catalog.h"
#include "sovo/bridge/topics.h"
#include "sovo/bridge/writer.h"
#include "test_bus.h"

namespace sovo::bridge {
namespace {

using namespace std::chrono_literals;
using Bytes = std::vector<std::uint8_t>;

constexpr std::int64_t kStamp = 1'700'000'000'123'456'789;

std::optional<CdrSample> take_one(RawReader& reader) {
  std::optional<CdrSample> result;
  (void)eventually([&] {
    reader.wait(100ms);
    (void)reader.take_each([&](CdrSample sample, const dds_sample_info_t&) { result = sample; });
    return result.has_value();
  });
  return result;
}

Bytes bytes_copy(const CdrSample& sample) { return {sample.bytes().begin(), sample.bytes().end()}; }

/// A message of a typed writer through a raw reader and a raw writer to a typed reader.
template <class T>
void pass_on(const Participant& from, const Participant& by, const Participant& to,
             const T& message) {
  SCOPED_TRACE(MessageTraits<T>::kRosName);
  const MessageSchema* schema = find_schema(MessageTraits<T>::kRosName);
  ASSERT_NE(schema, nullptr);
  auto typed_writer = require(Writer<T>::open(from, "source", latched(1)));
  auto raw_reader = require(RawReader::open(by, "source", *schema, latched(1)));
  auto raw_writer = require(RawWriter::open(by, "sink", *schema, latched(1)));
  auto typed_reader = require(Reader<T>::open(to, "sink", latched(1)));
  ASSERT_TRUE(typed_writer.write(message, kStamp).ok());
  const auto sample = take_one(raw_reader);
  ASSERT_TRUE(sample.has_value());
  EXPECT_EQ(sample->source_stamp_ns(), kStamp);
  ASSERT_GT(sample->bytes().size(), 4U);
  EXPECT_EQ(sample->bytes()[0], 0);
  EXPECT_EQ(sample->bytes()[1], 1) << "little-endian CDR";
  ASSERT_TRUE(raw_writer.write(sample->bytes(), sample->source_stamp_ns()).ok());
  bool received = false;
  ASSERT_TRUE(eventually([&] {
    typed_reader.wait(100ms);
    (void)typed_reader.take_each([&](const T& copy, const dds_sample_info_t& info) {
      received = true;
      EXPECT_TRUE(equal(message, copy));
      EXPECT_EQ(info.source_timestamp, kStamp);
    });
    return received;
  }));
}

template <class T>
void pass_on_filled(const Participant& from, const Participant& by, const Participant& to) {
  T message{};
  MessageFiller filler;
  filler.fill(message);
  pass_on(from, by, to, message);
}

TEST(RawCdr, PassesMessagesOnThroughSockets) {
  const Participant here = open_participant();
  const Participant there = open_remote_participant();
  pass_on_filled<msg::VoStatus>(here, there, here);
  pass_on_filled<msg::Keyframe>(there, here, there);
  pass_on_filled<msg::TFMessage>(here, there, here);
  pass_on_filled<msg::CameraInfo>(here, there, here);
}

TEST(RawCdr, PassesMessagesOnInsideAProcess) {
  const Participant here = open_participant();
  pass_on_filled<msg::ScaledOdometry>(here, here, here);
  pass_on_filled<msg::StereoCalibration>(here, here, here);
}

TEST(RawCdr, PassesOnImagesThatTravelInFragments) {
  const Participant here = open_participant();
  const Participant there = open_remote_participant();
  Bytes pixels(1280 * 720 + 3);  // an odd size
  std::iota(pixels.begin(), pixels.end(), std::uint8_t{0});
  msg::StereoFrame frame{};
  MessageFiller filler;
  filler.fill(frame);
  borrow(frame.left.data, pixels);
  borrow(frame.right.data, pixels);
  pass_on(here, there, here, frame);
}

TEST(RawCdr, BytesOfAnUnknownTypeArriveUnchanged) {
  const Participant here = open_participant();
  const Participant there = open_remote_participant();
  const MessageSchema type{"other_msgs/msg/Thing", "other_msgs::msg::dds_::Thing_", "",
                           "int32 x\n"};
  auto writer = require(RawWriter::open(here, "thing", type, latched(4)));
  auto reader = require(RawReader::open(there, "thing", type, latched(4)));
  const std::vector<Bytes> messages = {{0, 0, 0, 0, 0x12, 0x34, 0x56, 0x78},
                                       {0, 1, 0, 3, 1, 2, 3, 4},
                                       {0, 1, 0, 0},
                                       Bytes(200'000, 7)};
  std::vector<Bytes> received;
  for (std::size_t i = 0; i < messages.size(); ++i) {
    ASSERT_TRUE(writer.write(messages[i], kStamp + static_cast<std::int64_t>(i)).ok());
  }
  ASSERT_TRUE(eventually([&] {
    reader.wait(100ms);
    (void)reader.take_each([&](CdrSample sample, const dds_sample_info_t&) {
      received.push_back(bytes_copy(sample));
    });
    return received.size() == messages.size();
  }));
  EXPECT_EQ(received, messages);
}

TEST(RawCdr, ASampleOutlivesItsReader) {
  const Participant here = open_participant();
  const MessageSchema& type = *find_schema("std_msgs/msg/Header");
  std::optional<CdrSample> sample;
  const Bytes bytes = {0, 1, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0};
  {
    auto writer = require(RawWriter::open(here, "header", type, latched(1)));
    auto reader = require(RawReader::open(here, "header", type, latched(1)));
    ASSERT_TRUE(writer.write(bytes, kStamp).ok());
    sample = take_one(reader);
  }
  ASSERT_TRUE(sample.has_value());
  const CdrSample copied = *sample;
  sample.reset();
  EXPECT_EQ(bytes_copy(copied), bytes);
}

TEST(RawCdr, ABestEffortReaderTakesFromAReliableWriter) {
  const Participant here = open_participant();
  const MessageSchema& type = *find_schema("std_msgs/msg/Header");
  auto writer = require(RawWriter::open(here, "header", type, reliable(4)));
  auto reader = require(RawReader::open(here, "header", type, {4, false, true}));
  ASSERT_TRUE(eventually([&] { return writer.num_readers() == 1 && reader.num_writers() == 1; }));
  ASSERT_TRUE(writer.write(Bytes{0, 1, 0, 0, 5, 6, 7, 8}, kStamp).ok());
  EXPECT_TRUE(take_one(reader).has_value());
}

TEST(RawCdr, AMessageShorterThanItsHeaderIsRefused) {
  const Participant here = open_participant();
  auto writer =
      require(RawWriter::open(here, "header", *find_schema("std_msgs/msg/Header"), reliable(1)));
  const auto written = writer.write(Bytes{0, 1, 0}, kStamp);
  ASSERT_FALSE(written.ok());
  EXPECT_NE(written.error().find("/sovo/header"), std::string::npos);
}

TEST(TopicCatalog, KnowsTypeAndQosOfEveryTopic) {
  for (const CatalogTopic& topic : topic_catalog()) {
    ASSERT_NE(topic.schema, nullptr) << topic.name;
    EXPECT_EQ(find_schema(topic.schema->dds_name), topic.schema);
    EXPECT_FALSE(topic.schema->definition.empty());
    EXPECT_EQ(find_topic(topic.name), &topic) << "a name stands for one topic";
  }
  EXPECT_EQ(find_topic(topics::kStereo)->schema->ros_name, "sovo_msgs/msg/StereoFrame");
  EXPECT_TRUE(find_topic(topics::kKeyframe)->qos.latched);
  EXPECT_TRUE(find_topic("left/image_raw/compressed")->on_demand);
  EXPECT_TRUE(find_topic("right/image_color")->on_demand);
  EXPECT_EQ(find_topic("nothing"), nullptr);
  EXPECT_EQ(find_schema("no_msgs/msg/Nothing"), nullptr);
}

}  // namespace
}  // namespace sovo::bridge
