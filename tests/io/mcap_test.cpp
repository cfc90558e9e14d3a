#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <random>

#include "io_test_support.h"
#include "sovo/io/mcap_reader.h"
#include "sovo/io/mcap_writer.h"

namespace sovo {
namespace {

struct Plain {
  std::string topic;
  std::uint32_t sequence;
  std::uint64_t log_ns;
  std::uint64_t publish_ns;
  Bytes data;
  bool operator==(const Plain&) const = default;
};

class McapTest : public ::testing::TestWithParam<mcap::Compression> {
 protected:
  void SetUp() override {
    const std::string name =
        ::testing::UnitTest::GetInstance()->current_test_info()->name() + std::string(".mcap");
    std::string flat = name;
    std::replace(flat.begin(), flat.end(), '/', '_');
    path_ = std::filesystem::temp_directory_path() / (std::to_string(::getpid()) + flat);
    std::filesystem::remove(path_);
  }
  void TearDown() override { std::filesystem::remove(path_); }

  /// Two channels, several chunks.
  std::vector<Plain> write_sample(bool close, mcap::Compression compression,
                                  std::size_t chunk_bytes = 1500) {
    auto writer = McapWriter::create(path_, {compression, chunk_bytes});
    EXPECT_TRUE(writer.ok());
    const auto schema = (*writer)->add_schema("p/msg/A", "ros2msg", "int32 x\n");
    const auto a = (*writer)->add_channel(schema, "/a", {{"offered_qos_profiles", "[]"}});
    const auto b = (*writer)->add_channel(schema, "/b", {});
    std::vector<Plain> messages;
    for (std::uint32_t i = 0; i < 40; ++i) {
      Bytes data(100 + i);
      std::iota(data.begin(), data.end(), static_cast<std::uint8_t>(i));
      const bool second = i >= 10 && i % 3 == 0;
      const std::uint64_t log = 1000 + 10 * i;
      EXPECT_TRUE((*writer)->write(second ? b : a, i, log, log - 3, data).ok());
      messages.push_back({second ? "/b" : "/a", i, log, log - 3, data});
    }
    const Bytes text = {'y', 'a', 'm', 'l'};
    EXPECT_TRUE((*writer)->flush().ok());
    EXPECT_TRUE((*writer)->attach("calibration", "application/yaml", 5, text).ok());
    EXPECT_TRUE((*writer)->add_metadata("drops", {{"/a", "0"}}).ok());
    EXPECT_TRUE((*writer)->add_metadata("drops", {{"/a", "2"}}).ok());
    if (close) {
      const auto closed = (*writer)->close();
      EXPECT_TRUE(closed.ok());
      EXPECT_EQ((*writer)->bytes(), std::filesystem::file_size(path_));
    }
    return messages;
  }

  static std::vector<Plain> read_all(McapReader& reader) {
    std::vector<Plain> messages;
    while (const auto m = reader.next()) {
      messages.push_back({m->channel->topic, m->sequence, m->log_ns, m->publish_ns,
                          Bytes(m->data.begin(), m->data.end())});
    }
    return messages;
  }

  std::string path_;
};

std::string compression_name(const ::testing::TestParamInfo<mcap::Compression>& info) {
  return enum_names(info.param)[static_cast<std::size_t>(info.param)].second;
}
INSTANTIATE_TEST_SUITE_P(All, McapTest,
                         ::testing::Values(mcap::Compression::kNone, mcap::Compression::kLz4,
                                           mcap::Compression::kZstd),
                         compression_name);

TEST_P(McapTest, EverythingReadsBack) {
  const auto written = write_sample(true, GetParam());
  auto reader = McapReader::open(path_);
  ASSERT_TRUE(reader.ok()) << reader.error();
  EXPECT_TRUE((*reader)->is_indexed());
  EXPECT_TRUE((*reader)->notes().empty());
  EXPECT_EQ((*reader)->statistics().messages, written.size());
  EXPECT_EQ((*reader)->statistics().start_ns, 1000U);
  EXPECT_EQ((*reader)->statistics().end_ns, 1390U);
  EXPECT_EQ((*reader)->channels().at(0).metadata.at("offered_qos_profiles"), "[]");
  EXPECT_EQ((*reader)->schemas().at(1).name, "p/msg/A");
  EXPECT_EQ(read_all(**reader), written);
  ASSERT_EQ((*reader)->attachments().size(), 1U);
  const auto attached = (*reader)->read_attachment((*reader)->attachments()[0]);
  ASSERT_TRUE(attached.ok()) << attached.error();
  EXPECT_EQ(std::string(attached->begin(), attached->end()), "yaml");
  EXPECT_EQ((*reader)->metadata("drops")->at("/a"), "2");
  EXPECT_FALSE((*reader)->metadata("other"));
}

TEST_P(McapTest, AFileThatWasNotClosedReadsToItsLastChunk) {
  const auto written = write_sample(false, GetParam());
  auto reader = McapReader::open(path_);
  ASSERT_TRUE(reader.ok()) << reader.error();
  EXPECT_FALSE((*reader)->is_indexed());
  EXPECT_EQ(read_all(**reader), written);
  EXPECT_EQ((*reader)->statistics().messages, written.size());
  EXPECT_EQ((*reader)->attachments().size(), 1U);
  EXPECT_EQ((*reader)->metadata("drops")->at("/a"), "2");
}

TEST_P(McapTest, EveryCutLeavesWholeMessagesFromTheBeginning) {
  const auto written = write_sample(true, GetParam());
  std::ifstream in(path_, std::ios::binary);
  const std::string whole((std::istreambuf_iterator<char>(in)), {});
  std::size_t last = 0;
  for (std::size_t size = 0; size < whole.size(); size += 37) {
    std::filesystem::resize_file(path_, 0);
    std::ofstream(path_, std::ios::binary) << whole.substr(0, size);
    auto reader = McapReader::open(path_);
    if (size < mcap::kMagic.size()) {
      EXPECT_FALSE(reader.ok());
      continue;
    }
    ASSERT_TRUE(reader.ok()) << reader.error();
    const auto messages = read_all(**reader);
    ASSERT_GE(messages.size(), last) << size;
    last = messages.size();
    ASSERT_TRUE(std::equal(messages.begin(), messages.end(), written.begin())) << size;
  }
  EXPECT_EQ(last, written.size());
}

TEST_P(McapTest, AChangedByteNeverDoesMoreThanLoseMessages) {
  const auto written = write_sample(true, GetParam());
  std::ifstream in(path_, std::ios::binary);
  const std::string whole((std::istreambuf_iterator<char>(in)), {});
  std::mt19937 random(7);
  std::size_t damaged = 0;
  for (int i = 0; i < 200; ++i) {
    std::string text = whole;
    const std::size_t changes = 1 + random() % 4;
    for (std::size_t k = 0; k < changes; ++k) {
      text[8 + random() % (text.size() - 8)] = static_cast<char>(random());
    }
    std::ofstream(path_, std::ios::binary | std::ios::trunc) << text;
    auto reader = McapReader::open(path_);
    if (!reader) continue;
    const auto messages = read_all(**reader);
    EXPECT_LE(messages.size(), 2 * written.size());
    for (const auto& a : (*reader)->attachments()) (void)(*reader)->read_attachment(a);
    (void)(*reader)->metadata("drops");
    if (messages != written) ++damaged;
  }
  EXPECT_GT(damaged, 20U) << "the changes did not reach the messages";
}

TEST_F(McapTest, SeeksByTimeAndChannel) {
  const auto written = write_sample(true, mcap::Compression::kLz4);
  auto reader = McapReader::open(path_);
  ASSERT_TRUE(reader.ok()) << reader.error();
  (*reader)->seek(1200, [](const mcap::Channel& c) { return c.topic == "/b"; });
  std::vector<Plain> expected;
  for (const Plain& m : written) {
    if (m.log_ns >= 1200 && m.topic == "/b") expected.push_back(m);
  }
  EXPECT_EQ(read_all(**reader), expected);
  (*reader)->seek(0);
  EXPECT_EQ(read_all(**reader).size(), written.size());
}

TEST_F(McapTest, GivesMessagesInTheOrderOfTimeWhateverTheirPlace) {
  auto writer = McapWriter::create(path_, {mcap::Compression::kNone, 200});
  ASSERT_TRUE(writer.ok());
  const auto channel =
      (*writer)->add_channel((*writer)->add_schema("p/msg/A", "ros2msg", ""), "/a", {});
  for (const std::uint64_t time : {50, 20, 40, 90, 10, 30, 80, 70, 60}) {
    ASSERT_TRUE((*writer)->write(channel, 0, time, time, Bytes(60)).ok());
  }
  ASSERT_TRUE((*writer)->close().ok());
  auto reader = McapReader::open(path_);
  ASSERT_TRUE(reader.ok());
  std::vector<std::uint64_t> times;
  while (const auto m = (*reader)->next()) times.push_back(m->log_ns);
  EXPECT_EQ(times, (std::vector<std::uint64_t>{10, 20, 30, 40, 50, 60, 70, 80, 90}));
}

TEST_F(McapTest, ReadsMessagesThatAreInNoChunk) {
  mcap::ByteWriter file;
  file.raw(mcap::kMagic);
  mcap::ByteWriter header;
  header.text("ros2");
  header.text("other");
  file.record(mcap::Opcode::kHeader, header);
  file.record(mcap::Opcode::kSchema, to_body(mcap::Schema{1, "p/msg/A", "ros2msg", ""}));
  file.record(mcap::Opcode::kChannel, to_body(mcap::Channel{3, 1, "/a", "cdr", {}}));
  for (std::uint64_t i = 0; i < 3; ++i) {
    mcap::ByteWriter message;
    message.u16(3);
    message.u32(static_cast<std::uint32_t>(i));
    message.u64(10 + i);
    message.u64(10 + i);
    message.raw(Bytes{1, 2, 3});
    file.record(mcap::Opcode::kMessage, message);
  }
  std::ofstream(path_, std::ios::binary)
      .write(reinterpret_cast<const char*>(file.bytes().data()),
             static_cast<std::streamsize>(file.size()));
  auto reader = McapReader::open(path_);
  ASSERT_TRUE(reader.ok()) << reader.error();
  EXPECT_EQ(read_all(**reader).size(), 3U);
}

TEST_F(McapTest, AFileOfHugeClaimsTakesNoMemory) {
  mcap::ByteWriter file;
  file.raw(mcap::kMagic);
  mcap::ByteWriter chunk;
  chunk.u64(0);
  chunk.u64(1);
  chunk.u64(std::uint64_t{1} << 60);
  chunk.u32(0);
  chunk.text("zstd");
  chunk.u64(4);
  chunk.raw(Bytes{1, 2, 3, 4});
  file.record(mcap::Opcode::kChunk, chunk);
  file.record(mcap::Opcode::kChunk, std::uint64_t{1} << 62);
  std::ofstream(path_, std::ios::binary)
      .write(reinterpret_cast<const char*>(file.bytes().data()),
             static_cast<std::streamsize>(file.size()));
  auto reader = McapReader::open(path_);
  ASSERT_TRUE(reader.ok()) << reader.error();
  EXPECT_TRUE(read_all(**reader).empty());
  EXPECT_EQ((*reader)->notes().size(), 2U);
}

TEST_F(McapTest, WhatCannotBeReadOrWrittenIsNamed) {
  EXPECT_NE(McapReader::open("/nowhere/x.mcap").error().find("/nowhere/x.mcap"), std::string::npos);
  std::ofstream(path_) << "no MCAP at all";
  EXPECT_NE(McapReader::open(path_).error().find("not an MCAP file"), std::string::npos);
  EXPECT_NE(McapWriter::create(path_, {}).error().find("exists"), std::string::npos);
}

}  // namespace
}  // namespace sovo
