#include "sovo/io/mcap_writer.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace sovo {
namespace {

using mcap::ByteWriter;
using mcap::Opcode;

constexpr char kProfile[] = "ros2";
constexpr char kLibrary[] = "sovo";

}  // namespace

Result<std::unique_ptr<McapWriter>> McapWriter::create(const std::string& path,
                                                       const McapWriterConfig& config) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (file < 0) return Error{path + " cannot be made: " + std::strerror(errno)};
  std::unique_ptr<McapWriter> writer(new McapWriter(path, file, config));
  ByteWriter header;
  header.text(kProfile);
  header.text(kLibrary);
  ByteWriter begin;
  begin.raw(mcap::kMagic);
  begin.record(Opcode::kHeader, header);
  if (auto done = writer->put({begin.bytes()}); !done) return done.failure();
  return writer;
}

McapWriter::McapWriter(std::string path, int file, const McapWriterConfig& config)
    : path_(std::move(path)), file_(file), config_(config) {}

McapWriter::~McapWriter() {
  if (file_ >= 0) ::close(file_);
}

std::uint16_t McapWriter::add_schema(const std::string& name, const std::string& encoding,
                                     const std::string& data) {
  const auto id = static_cast<std::uint16_t>(schemas_.size() + 1);  // 0 means none
  schemas_.push_back({id, name, encoding, data});
  schema_declared_.push_back(false);
  return id;
}

std::uint16_t McapWriter::add_channel(std::uint16_t schema, const std::string& topic,
                                      const std::map<std::string, std::string>& metadata) {
  const auto id = static_cast<std::uint16_t>(channels_.size());
  channels_.push_back({id, schema, topic, "cdr", metadata});
  states_.emplace_back();
  return id;
}

/// Appends to the file; a part that does not fit is taken back, so that the file ends with a whole
/// record.
Result<void> McapWriter::put(const std::vector<ByteSpan>& parts) {
  if (!failure_.empty()) return Error{failure_};
  const std::uint64_t begin = offset_;
  for (ByteSpan part : parts) {
    while (!part.empty()) {
      const ssize_t written = ::write(file_, part.data(), part.size());
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) {
        failure_ = path_ + " cannot be written: " + std::strerror(written < 0 ? errno : ENOSPC);
        if (::ftruncate(file_, static_cast<off_t>(begin)) != 0) failure_ += "; its end is cut";
        offset_ = begin;
        return Error{failure_};
      }
      offset_ += static_cast<std::uint64_t>(written);
      part = part.subspan(static_cast<std::size_t>(written));
    }
  }
  for (const ByteSpan part : parts) data_crc_ = mcap::crc32(part, data_crc_);
  return {};
}

/// The first chunk that has a channel's messages has its description, too.
void McapWriter::declare(std::uint16_t channel) {
  if (std::exchange(states_[channel].declared, true)) return;
  const std::uint16_t schema = channels_[channel].schema_id;
  if (schema > 0 && !schema_declared_[schema - 1U]) {
    schema_declared_[schema - 1U] = true;
    chunk_.record(Opcode::kSchema, to_body(schemas_[schema - 1U]));
  }
  chunk_.record(Opcode::kChannel, to_body(channels_[channel]));
}

Result<void> McapWriter::write(std::uint16_t channel, std::uint32_t sequence, std::uint64_t log_ns,
                               std::uint64_t publish_ns, ByteSpan data) {
  if (!failure_.empty()) return Error{failure_};
  declare(channel);
  states_[channel].index.emplace_back(log_ns, chunk_.size());
  chunk_.record(Opcode::kMessage, 2 + 4 + 8 + 8 + data.size());
  chunk_.u16(channel);
  chunk_.u32(sequence);
  chunk_.u64(log_ns);
  chunk_.u64(publish_ns);
  chunk_.raw(data);
  chunk_start_ns_ = chunk_has_messages_ ? std::min(chunk_start_ns_, log_ns) : log_ns;
  chunk_end_ns_ = chunk_has_messages_ ? std::max(chunk_end_ns_, log_ns) : log_ns;
  chunk_has_messages_ = true;
  if (chunk_.size() >= config_.chunk_bytes) return close_chunk();
  return {};
}

Result<void> McapWriter::flush() { return chunk_has_messages_ ? close_chunk() : Result<void>(); }

Result<void> McapWriter::close_chunk() {
  mcap::ChunkIndex index;
  index.start_ns = chunk_start_ns_;
  index.end_ns = chunk_end_ns_;
  index.offset = offset_;
  index.uncompressed_size = chunk_.size();
  Bytes packed;
  if (config_.compression != mcap::Compression::kNone) {
    packed = mcap::compress(config_.compression, chunk_.bytes());
  }
  const bool is_packed = !packed.empty() && packed.size() < chunk_.size();
  const ByteSpan records = is_packed ? ByteSpan(packed) : ByteSpan(chunk_.bytes());
  index.compression = is_packed ? mcap::to_chunk_name(config_.compression) : "";
  index.compressed_size = records.size();

  ByteWriter head;
  const std::uint64_t body = 8 + 8 + 8 + 4 + 4 + index.compression.size() + 8 + records.size();
  head.record(Opcode::kChunk, body);
  head.u64(index.start_ns);
  head.u64(index.end_ns);
  head.u64(index.uncompressed_size);
  head.u32(mcap::crc32(chunk_.bytes()));
  head.text(index.compression);
  head.u64(records.size());
  index.length = mcap::kRecordHeaderSize + body;

  ByteWriter message_indexes;
  std::map<std::uint16_t, std::uint64_t> counts;
  for (std::size_t channel = 0; channel < states_.size(); ++channel) {
    auto& entries = states_[channel].index;
    if (entries.empty()) continue;
    const auto id = static_cast<std::uint16_t>(channel);
    index.message_index_offsets[id] = offset_ + index.length + message_indexes.size();
    message_indexes.record(Opcode::kMessageIndex, 2 + 4 + entries.size() * 16);
    message_indexes.u16(id);
    message_indexes.u32(static_cast<std::uint32_t>(entries.size() * 16));
    for (const auto& [time, offset] : entries) {
      message_indexes.u64(time);
      message_indexes.u64(offset);
    }
    counts[id] = entries.size();
    entries.clear();
  }
  index.message_index_length = message_indexes.size();
  if (auto done = put({head.bytes(), records, message_indexes.bytes()}); !done) return done;

  const bool first = statistics_.messages == 0;
  statistics_.start_ns = first ? index.start_ns : std::min(statistics_.start_ns, index.start_ns);
  statistics_.end_ns = first ? index.end_ns : std::max(statistics_.end_ns, index.end_ns);
  for (const auto& [channel, count] : counts) {
    statistics_.messages += count;
    statistics_.channel_messages[channel] += count;
  }
  chunks_.push_back(std::move(index));
  chunk_.clear();
  chunk_has_messages_ = false;
  return {};
}

Result<void> McapWriter::attach(const std::string& name, const std::string& media_type,
                                std::uint64_t log_ns, ByteSpan data) {
  ByteWriter body;
  body.u64(log_ns);
  body.u64(log_ns);
  body.text(name);
  body.text(media_type);
  body.u64(data.size());
  body.raw(data);
  body.u32(mcap::crc32(body.bytes()));
  ByteWriter record;
  record.record(Opcode::kAttachment, body);
  const std::uint64_t offset = offset_;
  if (auto done = put({record.bytes()}); !done) return done;
  attachments_.push_back({offset, record.size(), log_ns, log_ns, data.size(), name, media_type});
  return {};
}

Result<void> McapWriter::add_metadata(const std::string& name,
                                      const std::map<std::string, std::string>& values) {
  ByteWriter body;
  body.text(name);
  body.text_map(values);
  ByteWriter record;
  record.record(Opcode::kMetadata, body);
  const std::uint64_t offset = offset_;
  if (auto done = put({record.bytes()}); !done) return done;
  metadata_.push_back({offset, record.size(), name});
  return {};
}

namespace {

/// The records of the summary, each kind in a group whose place the summary offsets tell.
class Summary {
 public:
  explicit Summary(std::uint64_t start) : start_(start) {}

  void begin_group() { group_start_ = start_ + records.size(); }
  void end_group(Opcode opcode) {
    const std::uint64_t length = start_ + records.size() - group_start_;
    if (length == 0) return;
    offsets.record(Opcode::kSummaryOffset, 1 + 8 + 8);
    offsets.u8(static_cast<std::uint8_t>(opcode));
    offsets.u64(group_start_);
    offsets.u64(length);
  }
  template <class T>
  void group(Opcode opcode, const std::vector<T>& items) {
    begin_group();
    for (const T& item : items) records.record(opcode, to_body(item));
    end_group(opcode);
  }

  ByteWriter records;
  ByteWriter offsets;

 private:
  std::uint64_t start_;
  std::uint64_t group_start_ = 0;
};

}  // namespace

Result<void> McapWriter::close() {
  if (auto done = flush(); !done) return done;
  ByteWriter data_end;
  data_end.record(Opcode::kDataEnd, 4);
  data_end.u32(data_crc_);
  if (auto done = put({data_end.bytes()}); !done) return done;
  if (auto done = write_summary(); !done) return done;
  if (::close(std::exchange(file_, -1)) != 0) {
    failure_ = path_ + " cannot be closed: " + std::strerror(errno);
    return Error{failure_};
  }
  failure_ = path_ + " is closed";
  return {};
}

Result<void> McapWriter::write_summary() {
  const std::uint64_t start = offset_;
  Summary summary(start);
  summary.group(Opcode::kSchema, schemas_);
  summary.group(Opcode::kChannel, channels_);
  summary.begin_group();
  ByteWriter statistics;
  statistics.u64(statistics_.messages);
  statistics.u16(static_cast<std::uint16_t>(schemas_.size()));
  statistics.u32(static_cast<std::uint32_t>(channels_.size()));
  statistics.u32(static_cast<std::uint32_t>(attachments_.size()));
  statistics.u32(static_cast<std::uint32_t>(metadata_.size()));
  statistics.u32(static_cast<std::uint32_t>(chunks_.size()));
  statistics.u64(statistics_.start_ns);
  statistics.u64(statistics_.end_ns);
  statistics.u32(static_cast<std::uint32_t>(statistics_.channel_messages.size() * 10));
  for (const auto& [channel, count] : statistics_.channel_messages) {
    statistics.u16(channel);
    statistics.u64(count);
  }
  summary.records.record(Opcode::kStatistics, statistics);
  summary.end_group(Opcode::kStatistics);
  summary.group(Opcode::kChunkIndex, chunks_);
  summary.group(Opcode::kAttachmentIndex, attachments_);
  summary.group(Opcode::kMetadataIndex, metadata_);

  ByteWriter footer;
  footer.record(Opcode::kFooter, mcap::kFooterSize);
  footer.u64(start);
  footer.u64(start + summary.records.size());
  std::uint32_t crc = mcap::crc32(summary.records.bytes());
  crc = mcap::crc32(summary.offsets.bytes(), crc);
  footer.u32(mcap::crc32(footer.bytes(), crc));
  footer.raw(mcap::kMagic);
  return put({summary.records.bytes(), summary.offsets.bytes(), footer.bytes()});
}

}  // namespace sovo
