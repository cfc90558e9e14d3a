#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sovo/io/recording_config.h"
#include "sovo/io/result.h"

namespace sovo {

// What MCAP files are made of (https://mcap.dev/spec). Numbers are little-endian; a record is an
// opcode, a length of eight bytes and a body.

using ByteSpan = std::span<const std::uint8_t>;
using Bytes = std::vector<std::uint8_t>;

namespace mcap {

inline constexpr std::array<std::uint8_t, 8> kMagic = {0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};
inline constexpr std::size_t kRecordHeaderSize = 9;
inline constexpr std::size_t kFooterSize = 20;

enum class Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kAttachment = 0x09,
  kAttachmentIndex = 0x0A,
  kStatistics = 0x0B,
  kMetadata = 0x0C,
  kMetadataIndex = 0x0D,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

struct Schema {
  std::uint16_t id = 0;
  std::string name;      ///< "sensor_msgs/msg/Image"
  std::string encoding;  ///< "ros2msg"
  std::string data;
};

struct Channel {
  std::uint16_t id = 0;
  std::uint16_t schema_id = 0;
  std::string topic;
  std::string message_encoding;  ///< "cdr"
  std::map<std::string, std::string> metadata;
};

struct ChunkIndex {
  std::uint64_t start_ns = 0;  ///< Log time of the first message.
  std::uint64_t end_ns = 0;
  std::uint64_t offset = 0;  ///< Of the chunk's record in the file.
  std::uint64_t length = 0;  ///< Of the record, with its opcode and length.
  std::map<std::uint16_t, std::uint64_t> message_index_offsets;  ///< By channel.
  std::uint64_t message_index_length = 0;
  std::string compression;
  std::uint64_t compressed_size = 0;
  std::uint64_t uncompressed_size = 0;
};

struct AttachmentIndex {
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
  std::uint64_t log_ns = 0;
  std::uint64_t create_ns = 0;
  std::uint64_t data_size = 0;
  std::string name;
  std::string media_type;
};

struct MetadataIndex {
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
  std::string name;
};

struct Statistics {
  std::uint64_t messages = 0;
  std::uint64_t start_ns = 0;
  std::uint64_t end_ns = 0;
  std::map<std::uint16_t, std::uint64_t> channel_messages;
};

/// Bytes of a record under construction.
class ByteWriter {
 public:
  void u8(std::uint8_t v) { bytes_.push_back(v); }
  void u16(std::uint16_t v) { number(v); }
  void u32(std::uint32_t v) { number(v); }
  void u64(std::uint64_t v) { number(v); }
  void text(const std::string& v) {
    u32(static_cast<std::uint32_t>(v.size()));
    bytes_.insert(bytes_.end(), v.begin(), v.end());
  }
  void text_map(const std::map<std::string, std::string>& v);
  void raw(ByteSpan v) { bytes_.insert(bytes_.end(), v.begin(), v.end()); }
  /// Begins a record whose body length is known.
  void record(Opcode opcode, std::uint64_t length) {
    u8(static_cast<std::uint8_t>(opcode));
    u64(length);
  }
  /// A whole record.
  void record(Opcode opcode, const ByteWriter& body) {
    record(opcode, body.bytes_.size());
    raw(body.bytes_);
  }
  const Bytes& bytes() const { return bytes_; }
  std::size_t size() const { return bytes_.size(); }
  void clear() { bytes_.clear(); }

 private:
  template <class T>
  void number(T v) {
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      bytes_.push_back(static_cast<std::uint8_t>(v >> (8 * i)));
    }
  }
  Bytes bytes_;
};

/// Reads a record's body; beyond its end everything reads as 0 or empty and `ok` is false.
class ByteReader {
 public:
  explicit ByteReader(ByteSpan bytes) : bytes_(bytes) {}
  std::uint8_t u8() { return number<std::uint8_t>(); }
  std::uint16_t u16() { return number<std::uint16_t>(); }
  std::uint32_t u32() { return number<std::uint32_t>(); }
  std::uint64_t u64() { return number<std::uint64_t>(); }
  std::string text() {
    const ByteSpan v = raw(u32());
    return {v.begin(), v.end()};
  }
  std::map<std::string, std::string> text_map();
  ByteSpan raw(std::uint64_t size) {
    if (size > bytes_.size()) {
      ok_ = false;
      bytes_ = {};
      return {};
    }
    const ByteSpan result = bytes_.first(size);
    bytes_ = bytes_.subspan(size);
    return result;
  }
  bool ok() const { return ok_; }
  std::size_t left() const { return bytes_.size(); }

 private:
  template <class T>
  T number() {
    T v = 0;
    const ByteSpan part = raw(sizeof(T));
    for (std::size_t i = 0; i < part.size(); ++i) v |= static_cast<T>(T{part[i]} << (8 * i));
    return v;
  }
  ByteSpan bytes_;
  bool ok_ = true;
};

ByteWriter to_body(const Schema& schema);
ByteWriter to_body(const Channel& channel);
ByteWriter to_body(const ChunkIndex& index);
ByteWriter to_body(const AttachmentIndex& index);
ByteWriter to_body(const MetadataIndex& index);

// Whether the body could be read.
bool from_body(ByteSpan body, Schema* schema);
bool from_body(ByteSpan body, Channel* channel);
bool from_body(ByteSpan body, ChunkIndex* index);
bool from_body(ByteSpan body, AttachmentIndex* index);
bool from_body(ByteSpan body, MetadataIndex* index);
bool from_body(ByteSpan body, Statistics* statistics);

/// CRC-32 (as zlib's) of `bytes`, going on from `crc`.
std::uint32_t crc32(ByteSpan bytes, std::uint32_t crc = 0);

/// The name that a chunk carries: "", "lz4" or "zstd".
std::string to_chunk_name(Compression compression);

/// `bytes` compressed; empty where the library refuses.
Bytes compress(Compression compression, ByteSpan bytes);

/// `bytes` of a chunk with that compression name, which must give exactly `size` bytes.
Result<Bytes> decompress(const std::string& name, ByteSpan bytes, std::uint64_t size);

}  // namespace mcap
}  // namespace sovo
