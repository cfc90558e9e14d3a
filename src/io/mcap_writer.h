#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "sovo/io/mcap_format.h"

namespace sovo {

struct McapWriterConfig {
  mcap::Compression compression = mcap::Compression::kLz4;
  std::size_t chunk_bytes = 4U << 20;  ///< A chunk is closed when it has grown beyond this.
};

/// Writes an MCAP file: messages in chunks, with an index and statistics at the end.
///
///     auto writer = McapWriter::create("dive.mcap", {});
///     const auto schema = writer->add_schema("std_msgs/msg/Header", "ros2msg", text);
///     const auto channel = writer->add_channel(schema, "/header", metadata);
///     writer->write(channel, sequence, log_time_ns, publish_time_ns, cdr);
///     writer->close();
///
/// What was flushed is on disk as whole chunks: a file that was not closed reads up to there. After
/// an error the file ends with the last whole chunk, and nothing more can be written.
class McapWriter {
 public:
  /// Fails when `path` exists.
  static Result<std::unique_ptr<McapWriter>> create(const std::string& path,
                                                    const McapWriterConfig& config);
  ~McapWriter();
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  std::uint16_t add_schema(const std::string& name, const std::string& encoding,
                           const std::string& data);
  /// Messages are CDR with their encapsulation header.
  std::uint16_t add_channel(std::uint16_t schema, const std::string& topic,
                            const std::map<std::string, std::string>& metadata);

  /// `log_ns`: when it was received; `publish_ns`: its source timestamp [ns, UTC].
  Result<void> write(std::uint16_t channel, std::uint32_t sequence, std::uint64_t log_ns,
                     std::uint64_t publish_ns, ByteSpan data);
  /// Closes the chunk, when there is one, and hands it to the file system.
  Result<void> flush();

  Result<void> attach(const std::string& name, const std::string& media_type, std::uint64_t log_ns,
                      ByteSpan data);
  Result<void> add_metadata(const std::string& name,
                            const std::map<std::string, std::string>& values);

  /// Writes the rest and the index.
  Result<void> close();

  /// Bytes in the file, with those of the open chunk before compression.
  std::uint64_t bytes() const { return offset_ + chunk_.size(); }
  const mcap::Statistics& statistics() const { return statistics_; }
  const std::vector<mcap::Channel>& channels() const { return channels_; }

 private:
  McapWriter(std::string path, int file, const McapWriterConfig& config);

  Result<void> put(const std::vector<ByteSpan>& parts);
  Result<void> close_chunk();
  void declare(std::uint16_t channel);
  Result<void> write_summary();

  struct ChannelState {
    bool declared = false;                                       // in a chunk
    std::vector<std::pair<std::uint64_t, std::uint64_t>> index;  // time, offset in the chunk
  };

  std::string path_;
  int file_ = -1;
  McapWriterConfig config_;
  std::string failure_;
  std::uint64_t offset_ = 0;
  std::uint32_t data_crc_ = 0;

  mcap::ByteWriter chunk_;
  std::uint64_t chunk_start_ns_ = 0;
  std::uint64_t chunk_end_ns_ = 0;
  bool chunk_has_messages_ = false;

  std::vector<mcap::Schema> schemas_;
  std::vector<bool> schema_declared_;
  std::vector<mcap::Channel> channels_;
  std::vector<ChannelState> states_;  // by channel
  std::vector<mcap::ChunkIndex> chunks_;
  std::vector<mcap::AttachmentIndex> attachments_;
  std::vector<mcap::MetadataIndex> metadata_;
  mcap::Statistics statistics_;
};

}  // namespace sovo
