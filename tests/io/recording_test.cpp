#include "sovo/io/recording.h"

#include <gtest/gtest.h>
#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <limits>

#include "sovo/io/mcap_recovery.h"
#include "sovo/io/recording_writer.h"
#include "sovo/io/size.h"

namespace sovo {
namespace {

namespace fs = std::filesystem;

class RecordingTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string name = ::testing::UnitTest::GetInstance()->current_test_info()->name();
    folder_ = fs::temp_directory_path() / (name + std::to_string(::getpid()));
    fs::create_directories(folder_);
    config_.min_free_bytes = 0;
    config_.chunk_bytes = 1000;
    config_.compression = mcap::Compression::kNone;  // sizes as they are
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  /// 50 messages on two topics; the writer is closed only when `close`.
  std::unique_ptr<RecordingWriter> write(const std::string& name, bool close) {
    auto writer = RecordingWriter::create(path(name), config_);
    EXPECT_TRUE(writer.ok()) << writer.error();
    const auto odom =
        (*writer)->add_topic({"/sovo/odom", "nav_msgs/msg/Odometry", "text", "RIHS01_x", "- qos"});
    const auto status = (*writer)->add_topic({"/sovo/status", "p/msg/Status", "text 2", "", ""});
    EXPECT_TRUE((*writer)->attach("calibration.yaml", "application/yaml", 5, Bytes{1, 2}).ok());
    for (std::uint64_t i = 0; i < 50; ++i) {
      const auto topic = i % 2 == 0 ? odom : status;
      EXPECT_TRUE((*writer)->write(topic, 100 + i, 90 + i, Bytes(200, 7)).ok());
    }
    (*writer)->set_drops({{"/sovo/odom", 4}});
    if (close) {
      const auto closed = (*writer)->close();
      EXPECT_TRUE(closed.ok()) << closed.error();
    }
    return std::move(*writer);
  }

  std::uint64_t count(const std::string& name) {
    auto recording = Recording::open(path(name));
    EXPECT_TRUE(recording.ok()) << recording.error();
    std::uint64_t messages = 0;
    std::uint64_t last = 0;
    while (const auto message = (*recording)->next()) {
      EXPECT_GE(message->log_ns, last);
      last = message->log_ns;
      EXPECT_EQ(message->publish_ns, message->log_ns - 10);
      ++messages;
    }
    return messages;
  }

  fs::path folder_;
  RecordingConfig config_;
};

TEST_F(RecordingTest, AFolderIsSplitAndOpensAsABag) {
  config_.split_bytes = 4000;
  write("dive", true);
  auto recording = Recording::open(path("dive"));
  ASSERT_TRUE(recording.ok()) << recording.error();
  EXPECT_GT((*recording)->files().size(), 2U);
  EXPECT_EQ((*recording)->messages(), 50U);
  EXPECT_EQ((*recording)->start_ns(), 100U);
  EXPECT_EQ((*recording)->end_ns(), 149U);
  EXPECT_EQ((*recording)->find("/sovo/odom")->messages, 25U);
  EXPECT_EQ((*recording)->find("/sovo/odom")->type_hash, "RIHS01_x");
  EXPECT_EQ((*recording)->find("/sovo/odom")->offered_qos, "- qos");
  EXPECT_EQ((*recording)->only_topic_of("p/msg/Status")->topic, "/sovo/status");
  for (const auto& file : (*recording)->files()) EXPECT_EQ(file->attachments().size(), 1U);
  EXPECT_EQ(count("dive"), 50U);

  const YAML::Node bag = YAML::LoadFile(path("dive/metadata.yaml"))["rosbag2_bagfile_information"];
  EXPECT_EQ(bag["version"].as<int>(), 5);
  EXPECT_EQ(bag["storage_identifier"].as<std::string>(), "mcap");
  EXPECT_EQ(bag["message_count"].as<int>(), 50);
  EXPECT_EQ(bag["duration"]["nanoseconds"].as<int>(), 49);
  EXPECT_EQ(bag["starting_time"]["nanoseconds_since_epoch"].as<int>(), 100);
  EXPECT_EQ(bag["relative_file_paths"].size(), (*recording)->files().size());
  EXPECT_EQ(bag["relative_file_paths"][0].as<std::string>(), "dive_0.mcap");
  const YAML::Node topic = bag["topics_with_message_count"][0];
  EXPECT_EQ(topic["topic_metadata"]["name"].as<std::string>(), "/sovo/odom");
  EXPECT_EQ(topic["topic_metadata"]["offered_qos_profiles"].as<std::string>(), "- qos");
  EXPECT_EQ(topic["message_count"].as<int>(), 25);
}

TEST_F(RecordingTest, EveryFileBeginsWithWhatLateReadersNeed) {
  config_.split_bytes = 4000;
  auto writer = RecordingWriter::create(path("dive"), config_);
  ASSERT_TRUE(writer.ok()) << writer.error();
  const auto map = (*writer)->add_topic({"/map", "p/msg/Map", "text", "", "", 2});
  const auto frame = (*writer)->add_topic({"/frame", "p/msg/Frame", "text", "", ""});
  for (std::uint8_t i = 0; i < 4; ++i) {
    ASSERT_TRUE((*writer)->write(map, 100, 10, Bytes(50, i)).ok());
  }
  for (std::uint64_t i = 0; i < 50; ++i) {
    ASSERT_TRUE((*writer)->write(frame, 110 + i, 100 + i, Bytes(200, 9)).ok());
  }
  ASSERT_TRUE((*writer)->close().ok());

  auto recording = Recording::open(path("dive"));
  ASSERT_TRUE(recording.ok()) << recording.error();
  const std::size_t files = (*recording)->files().size();
  ASSERT_GT(files, 2U);
  EXPECT_EQ((*recording)->messages(), 54U);
  EXPECT_EQ((*recording)->find("/map")->messages, 4U);
  EXPECT_EQ((*recording)->find("/map")->repeated, 2 * (files - 1));
  std::uint64_t read = 0;
  while ((*recording)->next()) ++read;
  EXPECT_EQ(read, 54U);

  for (std::size_t i = 1; i < files; ++i) {
    auto alone = Recording::open((*recording)->files()[i]->path());
    ASSERT_TRUE(alone.ok()) << alone.error();
    for (const int value : {2, 3}) {
      const auto message = (*alone)->next();
      ASSERT_TRUE(message.has_value());
      EXPECT_EQ(message->topic->topic, "/map");
      EXPECT_EQ(int{message->data.front()}, value);
      EXPECT_EQ(message->publish_ns, 10U);
    }
  }
  // Messages after the first file's are all there when it begins later.
  (*recording)->seek(115);
  std::uint64_t later = 0;
  while ((*recording)->next()) ++later;
  EXPECT_EQ(later, 45U);
}

TEST_F(RecordingTest, OneFileAndDropsInIt) {
  write("one.mcap", true);
  EXPECT_EQ(count("one.mcap"), 50U);
  auto reader = McapReader::open(path("one.mcap"));
  ASSERT_TRUE(reader.ok());
  EXPECT_EQ((*reader)->metadata("sovo_drops")->at("/sovo/odom"), "4");
}

TEST_F(RecordingTest, SeeksByTimeAndTopic) {
  config_.split_bytes = 4000;
  write("dive", true);
  auto recording = Recording::open(path("dive"));
  ASSERT_TRUE(recording.ok());
  (*recording)->seek(131, [](const RecordedTopic& t) { return t.topic == "/sovo/odom"; });
  const auto message = (*recording)->next();
  ASSERT_TRUE(message.has_value());
  EXPECT_EQ(message->log_ns, 132U);
}

TEST_F(RecordingTest, AnUnfinishedRecordingIsMended) {
  write("dive", false);
  const std::uint64_t before = count("dive");
  EXPECT_GT(before, 40U) << "all but the open chunk";
  const auto mended = recover_mcap(path("dive/dive_0.mcap"));
  ASSERT_TRUE(mended.ok()) << mended.error();
  EXPECT_FALSE(mended->was_whole);
  EXPECT_EQ(mended->messages, before);
  EXPECT_TRUE(fs::exists(path("dive/dive_0.mcap.cut")));
  ASSERT_TRUE(write_bag_metadata(path("dive")).ok());
  EXPECT_EQ(count("dive"), before);
  auto reader = McapReader::open(path("dive/dive_0.mcap"));
  ASSERT_TRUE(reader.ok());
  EXPECT_TRUE((*reader)->is_indexed());
  EXPECT_EQ((*reader)->attachments().size(), 1U);
  EXPECT_TRUE(recover_mcap(path("dive/dive_0.mcap"))->was_whole);
}

TEST_F(RecordingTest, ADiskWithTooLittleLeftEndsIt) {
  config_.min_free_bytes = std::numeric_limits<std::uint64_t>::max();
  auto writer = write("dive", false);
  Result<void> tick;
  for (int i = 0; i < 2000 && tick; ++i) {
    ::usleep(5000);
    tick = writer->tick();
  }
  ASSERT_FALSE(tick.ok());
  EXPECT_NE(tick.error().find("MB left"), std::string::npos);
  ASSERT_TRUE(writer->close().ok());
  EXPECT_EQ(count("dive"), 50U);
}

TEST_F(RecordingTest, NothingIsOverwrittenAndWhatIsMissingIsNamed) {
  write("dive", true);
  EXPECT_NE(RecordingWriter::create(path("dive"), config_).error().find("exists"),
            std::string::npos);
  EXPECT_NE(Recording::open(path("none")).error().find("does not exist"), std::string::npos);
  EXPECT_NE(Recording::open(folder_.string()).error().find("no .mcap"), std::string::npos);
}

TEST(Size, HasUnits) {
  EXPECT_EQ(parse_size("0"), 0U);
  EXPECT_EQ(parse_size("1GB"), 1'000'000'000U);
  EXPECT_EQ(parse_size("1.5 MB"), 1'500'000U);
  EXPECT_EQ(parse_size("20kB"), 20'000U);
  for (const char* wrong : {"", "GB", "-1MB", "1XB", "1e40GB", "many"}) {
    EXPECT_FALSE(parse_size(wrong)) << wrong;
  }
}

}  // namespace
}  // namespace sovo
