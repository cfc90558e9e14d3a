#include "sovo/bridge/dashboard/dds_bus.h"

#include <gtest/gtest.h>

#include <map>
#include <mutex>

#include "bridge/test_bus.h"
#include "sovo/bridge/dashboard/topic_policy.h"
#include "sovo/bridge/reader.h"
#include "sovo/bridge/topics.h"
#include "sovo/bridge/writer.h"

namespace sovo::bridge {
namespace {

TEST(TopicPolicy, LeavesOutWhatFillsATether) {
  EXPECT_FALSE(is_forwarded("/sovo/stereo", "sovo_msgs/msg/StereoFrame"));
  EXPECT_FALSE(is_forwarded("/sovo/left/image_raw", "sensor_msgs/msg/Image"));
  EXPECT_FALSE(is_forwarded("/sovo/left/image_raw/compressed", "sensor_msgs/msg/CompressedImage"));
  EXPECT_TRUE(is_forwarded("/sovo/left/preview/compressed", "sensor_msgs/msg/CompressedImage"));
  EXPECT_TRUE(is_forwarded("/sovo/status", "sovo_msgs/msg/VoStatus"));
}

TEST(TopicPolicy, TakesCommandsOnlyWhereTheyBelong) {
  EXPECT_TRUE(is_command("/auv1/command", "sovo_msgs/msg/VoCommand"));
  EXPECT_TRUE(is_command("/auv1/record_command", "sovo_msgs/msg/RecorderCommand"));
  EXPECT_FALSE(is_command("/auv1/command", "sovo_msgs/msg/RecorderCommand"));
  EXPECT_FALSE(is_command("/auv1/odom", "nav_msgs/msg/Odometry"));
  EXPECT_FALSE(is_command("/command", "sovo_msgs/msg/VoCommand"));
}

TEST(TopicPolicy, NamesTopicsAsRosDoes) {
  EXPECT_EQ(ros_name_of("rt/sovo/odom"), "/sovo/odom");
  EXPECT_EQ(ros_name_of("ros_discovery_info"), std::nullopt);
  EXPECT_EQ(ros_name_of("rq/sovo/service"), std::nullopt);
}

class Gathering : public BusListener {
 public:
  void on_channel(const foxglove::Channel& channel) override {
    const std::lock_guard lock(mutex_);
    channels_[channel.topic] = channel;
  }
  void on_channel_gone(std::uint32_t id) override {
    const std::lock_guard lock(mutex_);
    std::erase_if(channels_, [id](const auto& item) { return item.second.id == id; });
  }
  void on_message(std::uint32_t id, std::int64_t stamp_ns, SharedBytes) override {
    const std::lock_guard lock(mutex_);
    stamps_[id] = stamp_ns;
  }
  std::optional<foxglove::Channel> channel(const std::string& topic) {
    const std::lock_guard lock(mutex_);
    const auto at = channels_.find(topic);
    return at == channels_.end() ? std::nullopt : std::optional(at->second);
  }
  std::int64_t stamp(std::uint32_t id) {
    const std::lock_guard lock(mutex_);
    return stamps_[id];
  }

 private:
  std::mutex mutex_;
  std::map<std::string, foxglove::Channel> channels_;
  std::map<std::uint32_t, std::int64_t> stamps_;
};

class Bus : public testing::Test {
 protected:
  Bus() {
    DdsConfig config;
    config.domain = test_domain();
    bus_ = require(DdsBus::open(config, {}));
    bus_->start(listener_);
  }
  ~Bus() override { bus_->stop(); }

  Participant vehicle_ = open_remote_participant();
  Gathering listener_;
  std::unique_ptr<DdsBus> bus_;
};

TEST_F(Bus, ReadsATopicOnlyWhileItIsWanted) {
  auto writer = require(Writer<msg::VoStatus>::open(vehicle_, "status", topics::kStatusQos));
  ASSERT_TRUE(eventually([&] { return listener_.channel("/sovo/status").has_value(); }));
  const auto channel = *listener_.channel("/sovo/status");
  EXPECT_EQ(channel.type, "sovo_msgs/msg/VoStatus");
  EXPECT_NE(channel.schema.find("MSG: sovo_msgs/StageTiming"), std::string::npos);
  EXPECT_EQ(channel.importance, Importance::kPose);
  const auto others = writer.num_readers();  // for the metrics
  bus_->want(channel.id, true);
  msg::VoStatus status{};
  ASSERT_TRUE(eventually([&] {
    (void)writer.write(status, 42);
    return listener_.stamp(channel.id) == 42;
  }));
  bus_->want(channel.id, false);
  EXPECT_TRUE(eventually([&] { return writer.num_readers() <= std::max(others, 1U); }));
}

TEST_F(Bus, TellsWhenATopicVanishes) {
  {
    auto writer = require(Writer<msg::Odometry>::open(vehicle_, "odom", topics::kOdometryQos));
    ASSERT_TRUE(eventually([&] { return listener_.channel("/sovo/odom").has_value(); }));
  }
  EXPECT_TRUE(eventually([&] { return !listener_.channel("/sovo/odom").has_value(); }));
}

TEST_F(Bus, OffersNoImages) {
  auto stereo = require(Writer<msg::StereoFrame>::open(vehicle_, "stereo", topics::kStereoQos));
  auto image = require(Writer<msg::Image>::open(vehicle_, "left/image_raw", reliable(2)));
  auto last = require(Writer<msg::Odometry>::open(vehicle_, "odom", topics::kOdometryQos));
  ASSERT_TRUE(eventually([&] { return listener_.channel("/sovo/odom").has_value(); }));
  EXPECT_FALSE(listener_.channel("/sovo/stereo"));
  EXPECT_FALSE(listener_.channel("/sovo/left/image_raw"));
  EXPECT_EQ(stereo.num_readers(), 0U);
  EXPECT_EQ(image.num_readers(), 0U);
}

TEST_F(Bus, GivesLatchedTopicsTheirDepth) {
  auto keyframes = require(Writer<msg::Keyframe>::open(vehicle_, "keyframe", topics::kKeyframeQos));
  auto path = require(Writer<msg::Path>::open(vehicle_, "path", topics::kPathQos));
  ASSERT_TRUE(eventually(
      [&] { return listener_.channel("/sovo/keyframe") && listener_.channel("/sovo/path"); }));
  EXPECT_EQ(listener_.channel("/sovo/keyframe")->latched_depth, 200);
  EXPECT_EQ(listener_.channel("/sovo/path")->latched_depth, 1);
}

TEST_F(Bus, PublishesCommandsAndSaysWhenNobodyListens) {
  const std::string type = "sovo_msgs/msg/VoCommand";
  EXPECT_FALSE(bus_->prepare("/sovo/odom", "nav_msgs/msg/Odometry").ok());
  ASSERT_TRUE(bus_->prepare("/sovo/command", type).ok());
  std::vector<std::uint8_t> bytes(4 + 88, 0);
  bytes[1] = 1;
  bytes[12] = 77;  // id
  const auto unheard = bus_->publish("/sovo/command", bytes);
  ASSERT_FALSE(unheard.ok());
  EXPECT_NE(unheard.error().find("nobody listens"), std::string::npos);
  auto reader = require(Reader<msg::VoCommand>::open(vehicle_, "command", topics::kCommandQos));
  ASSERT_TRUE(eventually([&] { return bus_->publish("/sovo/command", bytes).ok(); }));
  std::uint64_t id = 0;
  ASSERT_TRUE(eventually([&] {
    (void)reader.take_each([&](const msg::VoCommand& command, const auto&) { id = command.id; });
    return id == 77;
  }));
  EXPECT_FALSE(bus_->publish("/sovo/command", std::vector<std::uint8_t>(5000)).ok());
}

TEST_F(Bus, MeasuresVehicles) {
  auto writer = require(Writer<msg::VoStatus>::open(vehicle_, "status", topics::kStatusQos));
  ASSERT_TRUE(eventually([&] { return writer.num_readers() > 0; }));
  msg::VoStatus status{};
  status.inliers = 123;
  EXPECT_TRUE(eventually([&] {
    (void)writer.write(status);
    return bus_->metrics().find("sovo_vo_inliers{vehicle=\"/sovo\"} 123") != std::string::npos;
  }));
}

}  // namespace
}  // namespace sovo::bridge
