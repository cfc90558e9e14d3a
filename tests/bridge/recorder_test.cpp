#include "sovo/bridge/recorder.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "message_filler.h"
#include "sovo/bridge/raw_writer.h"
#include "sovo/bridge/topics.h"
#include "sovo/io/recording.h"
#include "test_bus.h"

namespace sovo::bridge {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using Traits = MessageTraits<msg::RecorderCommand>;

class RecorderTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string name = ::testing::UnitTest::GetInstance()->current_test_info()->name();
    folder_ = fs::temp_directory_path() / (name + std::to_string(::getpid()));
    fs::create_directories(folder_);
    config_.out = (folder_ / "dive").string();
    config_.min_free = "1MB";
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path folder_;
  RecorderConfig config_;
};

TEST_F(RecorderTest, KeepsBytesStampsTypesAndQos) {
  const Participant camera = open_remote_participant();
  const Participant here = open_participant();
  auto recorder = require(Recorder::open(here, config_));
  ASSERT_TRUE(recorder->start().ok());
  auto writer = require(Writer<msg::Keyframe>::open(camera, topics::kKeyframe, latched(200)));
  msg::Keyframe keyframe{};
  MessageFiller filler;
  filler.fill(keyframe);
  ASSERT_TRUE(writer.write(keyframe, 1234567).ok());
  ASSERT_TRUE(eventually([&] { return recorder->state().messages >= 1; }));
  recorder->stop("done");
  EXPECT_EQ(recorder->state().reason, "done");

  auto recording = require(Recording::open(config_.out));
  EXPECT_TRUE(recording->notes().empty());
  const RecordedTopic* topic = recording->find("/sovo/keyframe");
  ASSERT_NE(topic, nullptr);
  EXPECT_EQ(topic->type, "sovo_msgs/msg/Keyframe");
  EXPECT_EQ(topic->type_hash, type_hash::kSovoMsgsKeyframe);
  EXPECT_EQ(topic->definition, MessageTraits<msg::Keyframe>::kDefinition);
  EXPECT_NE(topic->offered_qos.find("durability: 1"), std::string::npos);
  recording->seek(0, [](const RecordedTopic& t) { return t.topic == "/sovo/keyframe"; });
  const auto message = recording->next();
  ASSERT_TRUE(message.has_value());
  EXPECT_EQ(message->publish_ns, 1234567U);
}

TEST_F(RecorderTest, ObeysCommandsOnceAndTellsItsState) {
  const Participant user = open_remote_participant();
  const Participant here = open_participant();
  auto recorder = require(Recorder::open(here, config_));
  auto commands = require(
      Writer<msg::RecorderCommand>::open(user, topics::kRecordCommand, topics::kRecordCommandQos));
  auto states = require(
      Reader<msg::RecorderStatus>::open(user, topics::kRecordStatus, topics::kRecordStatusQos));
  ASSERT_TRUE(eventually([&] { return commands.num_readers() > 0 && states.num_writers() > 0; }));
  struct Answer {
    std::uint64_t id = 0;
    bool recording = false;
    std::string reason;
  } last;
  const auto send = [&](std::uint64_t id, std::uint8_t what, const std::string& name) {
    msg::RecorderCommand command{};
    command.id = id;
    command.command = what;
    command.name = borrow(name);
    EXPECT_TRUE(commands.write(command).ok());
  };
  const auto ask = [&](std::uint64_t id, std::uint8_t what, const std::string& name) {
    send(id, what, name);
    return eventually([&] {
      recorder->poll();
      (void)states.take_each([&](const msg::RecorderStatus& m, const dds_sample_info_t&) {
        last = {m.last_command_id, m.recording, m.reason};
      });
      return last.id == id;
    });
  };
  ASSERT_TRUE(ask(1, Traits::START, "night"));
  EXPECT_TRUE(last.recording) << last.reason;
  EXPECT_TRUE(fs::exists(folder_ / "night" / "night_0.mcap"));
  ASSERT_TRUE(ask(2, Traits::START, ""));
  EXPECT_NE(last.reason.find("already"), std::string::npos);
  ASSERT_TRUE(ask(3, Traits::STOP, ""));
  EXPECT_FALSE(last.recording);
  EXPECT_EQ(last.reason, "stopped by command");
  send(1, Traits::START, "again");  // an id that was obeyed already
  ASSERT_TRUE(ask(4, Traits::START, "../elsewhere"));
  EXPECT_FALSE(fs::exists(folder_ / "again"));
  EXPECT_FALSE(last.recording);
  EXPECT_NE(last.reason.find("refused"), std::string::npos);
  ASSERT_TRUE(ask(5, Traits::START, ""));
  EXPECT_TRUE(fs::exists(folder_ / "dive" / "dive_0.mcap"));
}

TEST_F(RecorderTest, ARecordingThatBeginsLaterHasWhatWasLatched) {
  const Participant here = open_participant();
  auto recorder = require(Recorder::open(here, config_));
  auto writer = require(Writer<msg::Keyframe>::open(here, topics::kKeyframe, latched(200)));
  ASSERT_TRUE(eventually([&] { return writer.num_readers() == 1; }));
  msg::Keyframe keyframe{};
  keyframe.header.frame_id = borrow("odom");
  for (std::uint32_t id = 0; id < 3; ++id) {
    keyframe.id = id;
    ASSERT_TRUE(writer.write(keyframe).ok());
  }
  std::this_thread::sleep_for(300ms);  // so that they have been taken
  for (int recording = 0; recording < 2; ++recording) {
    ASSERT_TRUE(recorder->start().ok());
    ASSERT_TRUE(eventually([&] { return recorder->state().messages == 3; }));
    recorder->stop("done");
  }
}

TEST_F(RecorderTest, DropsAreCountedByTopicAndWrittenIntoTheFile) {
  const Participant here = open_participant();
  config_.queue = "100kB";
  auto recorder = require(Recorder::open(here, config_));
  ASSERT_TRUE(recorder->start().ok());
  auto status = require(
      RawWriter::open(here, "status", *find_schema("sovo_msgs/msg/VoStatus"), topics::kStatusQos));
  ASSERT_TRUE(eventually([&] { return status.num_readers() == 1; }));
  const std::vector<std::uint8_t> large(200'000, 0);
  ASSERT_TRUE(status.write(large, 1).ok());
  ASSERT_TRUE(eventually([&] { return recorder->state().dropped == 1; }));
  ASSERT_TRUE(status.write(std::vector<std::uint8_t>(100, 0), 2).ok());
  ASSERT_TRUE(eventually([&] { return recorder->state().messages == 1; }));
  recorder->stop("done");
  EXPECT_EQ(recorder->state().drops.at("/sovo/status"), 1U);
  auto recording = require(Recording::open(config_.out));
  EXPECT_EQ(recording->files()[0]->metadata("sovo_drops")->at("/sovo/status"), "1");
}

TEST_F(RecorderTest, TopicsOfUnknownTypeAreNamed) {
  const Participant here = open_participant();
  const Participant other = open_remote_participant();
  config_.topics = "/other/thing";
  auto recorder = require(Recorder::open(here, config_));
  const MessageSchema type{"other_msgs/msg/Thing", "other_msgs::msg::dds_::Thing_", "",
                           "int32 x\n"};
  auto writer = require(RawWriter::open(other, "/other/thing", type, reliable(1)));
  ASSERT_TRUE(eventually([&] { return !recorder->unknown_topics().empty(); }));
  EXPECT_EQ(recorder->unknown_topics()[0], "/other/thing (other_msgs/msg/Thing)");
}

TEST_F(RecorderTest, ARecordingIsNeverOverwritten) {
  config_.out = (folder_ / "one.mcap").string();
  std::ofstream(config_.out) << "precious";
  const Participant here = open_participant();
  auto recorder = require(Recorder::open(here, config_));
  ASSERT_TRUE(recorder->start().ok());
  EXPECT_NE(recorder->state().file, config_.out) << "another name, by date and time";
  EXPECT_EQ(fs::file_size(config_.out), 8U);
}

}  // namespace
}  // namespace sovo::bridge
