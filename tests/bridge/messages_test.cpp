#include <gtest/gtest.h>

#include "message_filler.h"
#include "sovo/bridge/reader.h"
#include "sovo/bridge/ros_names.h"
#include "sovo/bridge/writer.h"
#include "test_bus.h"

namespace sovo::bridge {
namespace {

/// Writes a filled message and compares what arrives at the other side of a socket.
template <class T>
void round_trip(const Participant& from, const Participant& to) {
  SCOPED_TRACE(MessageTraits<T>::kRosName);
  auto writer = require(Writer<T>::open(from, "round_trip", latched(1)));
  auto reader = require(Reader<T>::open(to, "round_trip", latched(1)));
  T sent{};
  MessageFiller filler;
  filler.fill(sent);
  const auto written = writer.write(sent, 123456789);
  ASSERT_TRUE(written.ok()) << written.error();
  int received = 0;
  ASSERT_TRUE(eventually([&] {
    reader.wait(std::chrono::milliseconds(100));
    (void)reader.take_each([&](const T& message, const dds_sample_info_t& info) {
      ++received;
      EXPECT_TRUE(equal(sent, message));
      EXPECT_EQ(info.source_timestamp, 123456789);
    });
    return received > 0;
  }));
  EXPECT_EQ(received, 1);
}

TEST(Messages, TravelUnchangedThroughSockets) {
  const Participant here = open_participant();
  const Participant there = open_remote_participant();
  round_trip<msg::StereoFrame>(here, there);
  round_trip<msg::StereoCalibration>(there, here);
  round_trip<msg::ScaledOdometry>(here, there);
  round_trip<msg::VoStatus>(there, here);
  round_trip<msg::Keyframe>(here, there);
  round_trip<msg::TrackedPoints>(there, here);
  round_trip<msg::VoCommand>(here, there);
  round_trip<msg::RecorderCommand>(there, here);
  round_trip<msg::RecorderStatus>(here, there);
  round_trip<msg::Odometry>(here, there);
  round_trip<msg::CameraInfo>(there, here);
  round_trip<msg::DiagnosticArray>(here, there);
  round_trip<msg::TFMessage>(there, here);
}

TEST(Messages, AComparisonThatMustFailDoes) {
  msg::VoStatus a{};
  msg::VoStatus b{};
  MessageFiller first;
  MessageFiller second;
  first.fill(a);
  second.fill(b);
  EXPECT_TRUE(equal(a, b));
  b.stages._buffer[2].max_ms += 1.0F;
  EXPECT_FALSE(equal(a, b));
}

TEST(Messages, TypeNamesAreThoseOfRos) {
  int types = 0;
  for_each_message_type([&]<class T>() {
    ++types;
    const std::string ros = MessageTraits<T>::kRosName;
    EXPECT_EQ(MessageTraits<T>::descriptor().m_typename, dds_type(ros));
    EXPECT_EQ(std::string(MessageTraits<T>::kHash).substr(0, 7), "RIHS01_") << ros;
    EXPECT_EQ(std::string(MessageTraits<T>::kHash).size(), 71U) << ros;
    EXPECT_EQ(MessageTraits<T>::descriptor().m_nkeys, 0U) << ros;
  });
  EXPECT_GT(types, 40);
  EXPECT_EQ(dds_type("sensor_msgs/msg/Image"), "sensor_msgs::msg::dds_::Image_");
}

TEST(Messages, SchemasHoldAllTypesInThem) {
  const std::string schema = MessageTraits<msg::StereoFrame>::kDefinition;
  for (const char* part :
       {"MSG: sovo_msgs/SideImage\n", "MSG: std_msgs/Header\n", "MSG: builtin_interfaces/Time\n"}) {
    EXPECT_NE(schema.find(std::string(80, '=') + "\n" + part), std::string::npos) << part;
  }
}

}  // namespace
}  // namespace sovo::bridge
