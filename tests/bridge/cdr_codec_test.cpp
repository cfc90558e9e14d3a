#include "sovo/bridge/cdr_codec.h"

#include <gtest/gtest.h>

#include <random>

#include "message_filler.h"
#include "sovo/bridge/offered_qos.h"
#include "sovo/bridge/raw_reader.h"
#include "sovo/bridge/writer.h"
#include "test_bus.h"

namespace sovo::bridge {
namespace {

template <class T>
void expect_same_as_the_wire(const Participant& here) {
  SCOPED_TRACE(MessageTraits<T>::kRosName);
  T message{};
  MessageFiller filler;
  filler.fill(message);
  auto writer = require(Writer<T>::open(here, "codec", latched(1)));
  auto reader =
      require(RawReader::open(here, "codec", *find_schema(MessageTraits<T>::kRosName), latched(1)));
  ASSERT_TRUE(writer.write(message).ok());
  std::vector<std::uint8_t> wire;
  ASSERT_TRUE(eventually([&] {
    (void)reader.take_each([&](CdrSample sample, const dds_sample_info_t&) {
      wire.assign(sample.bytes().begin(), sample.bytes().end());
    });
    return !wire.empty();
  }));
  const auto decoded = decode<T>(wire);
  ASSERT_TRUE(decoded.ok()) << decoded.error();
  EXPECT_TRUE(equal(message, **decoded));
  auto encoded = encode(message);
  const std::size_t padding = wire.size() - encoded.size();  // up to the next multiple of 4
  EXPECT_LT(padding, 4U);
  encoded.resize(wire.size());
  encoded[3] = wire[3];  // says how much padding there is
  EXPECT_EQ(encoded, wire);
}

TEST(CdrCodec, IsThatOfTheWire) {
  const Participant here = open_participant();
  expect_same_as_the_wire<msg::StereoFrame>(here);
  expect_same_as_the_wire<msg::StereoCalibration>(here);
  expect_same_as_the_wire<msg::VoStatus>(here);
  expect_same_as_the_wire<msg::CameraInfo>(here);
  expect_same_as_the_wire<msg::Image>(here);
  expect_same_as_the_wire<msg::TFMessage>(here);
  expect_same_as_the_wire<msg::DiagnosticArray>(here);
}

TEST(CdrCodec, ReadsBigEndianNumbers) {
  const std::vector<std::uint8_t> bytes = {0, 0, 0, 0, 0, 0, 1, 2, 0, 0, 3, 4};
  const auto time = decode<msg::Time>(bytes);
  ASSERT_TRUE(time.ok()) << time.error();
  EXPECT_EQ((*time)->sec, 0x0102);
  EXPECT_EQ((*time)->nanosec, 0x0304U);
}

TEST(CdrCodec, EveryCutIsRefusedAndNoChangeDoesHarm) {
  msg::StereoCalibration message{};
  MessageFiller filler;
  filler.fill(message);
  const auto whole = encode(message);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(decode<msg::StereoCalibration>(CdrBytes(whole).first(size)).ok()) << size;
  }
  std::mt19937 random(3);
  for (int i = 0; i < 2000; ++i) {
    auto bytes = whole;
    for (int k = 0; k < 3; ++k)
      bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
    const auto decoded = decode<msg::StereoCalibration>(bytes);
    if (decoded) (void)encode(**decoded);  // touches everything that was read
  }
}

TEST(OfferedQos, ReadsBackAndReadsOtherForms) {
  for (const TopicQos& qos : {reliable(4), latched(200), TopicQos{7, false, true}}) {
    const TopicQos read = parse_offered_qos(offered_qos_text(qos), reliable(99));
    EXPECT_EQ(read.depth, qos.depth);
    EXPECT_EQ(read.latched, qos.latched);
    EXPECT_EQ(read.best_effort, qos.best_effort);
  }
  const std::string words =
      "- history: keep_last\n  depth: 5\n  reliability: best_effort\n  durability: "
      "transient_local\n";
  EXPECT_TRUE(parse_offered_qos(words, reliable(1)).best_effort);
  EXPECT_TRUE(parse_offered_qos(words, reliable(1)).latched);
  EXPECT_EQ(parse_offered_qos("", latched(3)).depth, 3);
}

}  // namespace
}  // namespace sovo::bridge
