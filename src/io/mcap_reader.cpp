#include "sovo/io/mcap_reader.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>
#include <utility>

namespace sovo {
namespace {

using mcap::ByteReader;
using mcap::kRecordHeaderSize;
using mcap::Opcode;

constexpr std::uint64_t kLargestRead = std::uint64_t{1} << 30;
constexpr std::uint64_t kLargestPlainSection = 4U << 20;
constexpr std::uint64_t kMostLoaded = std::uint64_t{1} << 30;  // bytes of chunks that overlap
constexpr std::size_t kMessageHead = 2 + 4 + 8 + 8;
constexpr std::size_t kChunkHead = 8 + 8 + 8 + 4 + 4;  // up to the name of the compression

/// Calls f(opcode, body) for each whole record; false when the end of the last one is missing.
template <class F>
bool for_each_record(ByteSpan records, F&& f) {
  ByteReader in(records);
  while (in.left() > 0) {
    const auto opcode = static_cast<Opcode>(in.u8());
    const std::uint64_t length = in.u64();
    const ByteSpan body = in.raw(length);
    if (!in.ok()) return false;
    f(opcode, body);
  }
  return true;
}

}  // namespace

Result<std::unique_ptr<McapReader>> McapReader::open(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return Error{path + " cannot be read: " + std::strerror(errno)};
  struct stat status {};
  const bool is_file = ::fstat(file, &status) == 0 && S_ISREG(status.st_mode);
  std::unique_ptr<McapReader> reader(
      new McapReader(path, file, is_file ? static_cast<std::uint64_t>(status.st_size) : 0));
  if (!is_file) return Error{path + " is not a file"};
  if (auto good = reader->check_magic(); !good) return good.failure();
  if (!reader->load_summary()) {
    reader->schemas_.clear();
    reader->channels_.clear();
    reader->statistics_ = {};
    reader->attachments_.clear();
    reader->metadata_.clear();
    reader->sections_.clear();
    reader->scan();
  }
  reader->seek(0);
  return reader;
}

McapReader::McapReader(std::string path, int file, std::uint64_t size)
    : path_(std::move(path)), file_(file), size_(size) {}

McapReader::~McapReader() { ::close(file_); }

bool McapReader::read_at(std::uint64_t offset, std::uint8_t* to, std::size_t size) const {
  if (offset > size_ || size > size_ - offset) return false;
  while (size > 0) {
    const ssize_t got = ::pread(file_, to, size, static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    to += got;
    size -= static_cast<std::size_t>(got);
    offset += static_cast<std::uint64_t>(got);
  }
  return true;
}

Result<Bytes> McapReader::read_bytes(std::uint64_t offset, std::uint64_t size) const {
  if (offset > size_ || size > size_ - offset || size > kLargestRead) {
    return Error{path_ + ": a record at byte " + std::to_string(offset) + " goes beyond the end"};
  }
  Bytes bytes(size);
  if (!read_at(offset, bytes.data(), bytes.size())) {
    return Error{path_ + " cannot be read: " + std::strerror(errno)};
  }
  return bytes;
}

Result<void> McapReader::check_magic() const {
  std::array<std::uint8_t, mcap::kMagic.size()> magic{};
  if (!read_at(0, magic.data(), magic.size()) || magic != mcap::kMagic) {
    return Error{path_ + " is not an MCAP file"};
  }
  return {};
}

/// Footer and summary; false when there is none to rely on.
bool McapReader::load_summary() {
  constexpr std::uint64_t kTail = kRecordHeaderSize + mcap::kFooterSize + mcap::kMagic.size();
  if (size_ < mcap::kMagic.size() + kTail) return false;
  const auto tail = read_bytes(size_ - kTail, kTail);
  if (!tail) return false;
  ByteReader footer(*tail);
  const auto opcode = static_cast<Opcode>(footer.u8());
  const std::uint64_t length = footer.u64();
  const std::uint64_t start = footer.u64();
  const std::uint64_t offsets_start = footer.u64();
  const std::uint32_t crc = footer.u32();
  const ByteSpan magic = footer.raw(mcap::kMagic.size());
  if (opcode != Opcode::kFooter || length != mcap::kFooterSize || start == 0 ||
      start > size_ - kTail || !std::equal(magic.begin(), magic.end(), mcap::kMagic.begin())) {
    return false;
  }
  const auto summary = read_bytes(start, size_ - kTail - start);
  if (!summary) return false;
  if (crc != 0) {
    const ByteSpan footer_part = ByteSpan(*tail).first(kRecordHeaderSize + 16);
    if (mcap::crc32(footer_part, mcap::crc32(*summary)) != crc) {
      notes_.push_back(path_ + ": the index is damaged; the file is read through");
      return false;
    }
  }
  ByteSpan records(*summary);
  if (offsets_start != 0) {
    if (offsets_start < start || offsets_start > size_ - kTail) return false;
    records = records.first(offsets_start - start);
  }
  return take_summary(records);
}

bool McapReader::take_summary(ByteSpan records) {
  bool good = true;
  bool has_statistics = false;
  const bool whole = for_each_record(records, [&](Opcode opcode, ByteSpan body) {
    mcap::Schema schema;
    mcap::Channel channel;
    mcap::ChunkIndex chunk;
    mcap::AttachmentIndex attachment;
    mcap::MetadataIndex metadata;
    if (opcode == Opcode::kSchema) {
      good = from_body(body, &schema) && good;
      schemas_.emplace(schema.id, schema);
    } else if (opcode == Opcode::kChannel) {
      good = from_body(body, &channel) && good;
      channels_.emplace(channel.id, channel);
    } else if (opcode == Opcode::kStatistics) {
      good = from_body(body, &statistics_) && good;
      has_statistics = true;
    } else if (opcode == Opcode::kChunkIndex) {
      good = from_body(body, &chunk) && good;
      sections_.push_back({chunk.offset, chunk.length, chunk.start_ns, chunk.end_ns, true,
                           std::move(chunk.message_index_offsets)});
    } else if (opcode == Opcode::kAttachmentIndex) {
      good = from_body(body, &attachment) && good;
      attachments_.push_back(attachment);
    } else if (opcode == Opcode::kMetadataIndex) {
      good = from_body(body, &metadata) && good;
      metadata_.push_back(metadata);
    }
  });
  // Without chunks in the index, or without channels, the messages are to be found by reading on.
  if (!good || !whole || !has_statistics) return false;
  if (statistics_.messages > 0 && (sections_.empty() || channels_.empty())) return false;
  std::stable_sort(sections_.begin(), sections_.end(),
                   [](const Section& a, const Section& b) { return a.start_ns < b.start_ns; });
  indexed_ = true;
  return true;
}

/// Reads through the file up to its end or its first cut.
void McapReader::scan() {
  std::uint64_t offset = mcap::kMagic.size();
  while (offset < size_) {
    std::array<std::uint8_t, kRecordHeaderSize> head{};
    if (!read_at(offset, head.data(), head.size())) break;
    ByteReader in(head);
    const auto opcode = static_cast<Opcode>(in.u8());
    const std::uint64_t length = in.u64();
    if (opcode == Opcode::kDataEnd || opcode == Opcode::kFooter) {
      offset = size_;
      break;
    }
    if (length > size_ - offset - kRecordHeaderSize) break;
    scan_record(opcode, offset, length);
    offset += kRecordHeaderSize + length;
  }
  if (offset < size_) {
    notes_.push_back(path_ + ": the file is cut at byte " + std::to_string(offset) + " of " +
                     std::to_string(size_) + "; what lies before is read");
  }
  count_sections();
}

std::uint64_t McapReader::scan_record(Opcode opcode, std::uint64_t offset, std::uint64_t length) {
  const std::uint64_t whole = kRecordHeaderSize + length;
  const std::uint64_t body = offset + kRecordHeaderSize;
  if (opcode == Opcode::kChunk) {
    std::array<std::uint8_t, 16> times{};
    if (!read_at(body, times.data(), times.size())) return whole;
    ByteReader in(times);
    Section section{offset, whole, in.u64(), 0, true, {}};
    section.end_ns = in.u64();
    sections_.push_back(std::move(section));
  } else if (opcode == Opcode::kAttachment || opcode == Opcode::kMetadata) {
    const auto bytes = read_bytes(body, std::min<std::uint64_t>(length, 1U << 16));
    if (!bytes) return whole;
    ByteReader in(*bytes);
    if (opcode == Opcode::kMetadata) {
      metadata_.push_back({offset, whole, in.text()});
      return whole;
    }
    mcap::AttachmentIndex index{offset, whole, in.u64(), 0, 0, {}, {}};
    index.create_ns = in.u64();
    index.name = in.text();
    index.media_type = in.text();
    index.data_size = in.u64();
    if (in.ok()) attachments_.push_back(index);
  } else if (opcode == Opcode::kSchema || opcode == Opcode::kChannel ||
             opcode == Opcode::kMessage) {
    note_plain(offset, whole, opcode);
  }
  return whole;
}

/// Adds a record that is in no chunk to the run of such records before it.
void McapReader::note_plain(std::uint64_t offset, std::uint64_t length, Opcode opcode) {
  std::uint64_t log_ns = 0;
  if (opcode == Opcode::kMessage) {
    std::array<std::uint8_t, kMessageHead> head{};
    if (length < kRecordHeaderSize + kMessageHead ||
        !read_at(offset + kRecordHeaderSize, head.data(), head.size())) {
      return;
    }
    ByteReader in(head);
    in.raw(6);
    log_ns = in.u64();
  }
  Section* last = sections_.empty() ? nullptr : &sections_.back();
  const bool continues = last != nullptr && !last->is_chunk &&
                         last->offset + last->length == offset &&
                         last->length < kLargestPlainSection;
  if (!continues) {
    sections_.push_back({offset, length, std::numeric_limits<std::uint64_t>::max(), 0, false, {}});
    last = &sections_.back();
  } else {
    last->length += length;
  }
  if (opcode != Opcode::kMessage) return;
  last->start_ns = std::min(last->start_ns, log_ns);
  last->end_ns = std::max(last->end_ns, log_ns);
}

/// Without an index: channels and statistics from the messages themselves.
void McapReader::count_sections() {
  std::vector<Section> good;
  for (Section& section : sections_) {
    const auto loaded = load(section);
    if (!loaded) {
      notes_.push_back(loaded.error());
      continue;
    }
    if (loaded->entries.empty()) continue;
    section.start_ns = loaded->entries.front().log_ns;
    section.end_ns = loaded->entries.back().log_ns;
    const bool first = statistics_.messages == 0;
    statistics_.start_ns =
        first ? section.start_ns : std::min(statistics_.start_ns, section.start_ns);
    statistics_.end_ns = first ? section.end_ns : std::max(statistics_.end_ns, section.end_ns);
    for (const Entry& entry : loaded->entries) {
      ByteReader in(ByteSpan(loaded->records).subspan(entry.offset, entry.length));
      const std::uint16_t channel = in.u16();
      ++statistics_.messages;
      ++statistics_.channel_messages[channel];
      section.channels[channel] = 0;
    }
    good.push_back(std::move(section));
  }
  sections_ = std::move(good);
  std::stable_sort(sections_.begin(), sections_.end(),
                   [](const Section& a, const Section& b) { return a.start_ns < b.start_ns; });
}

Result<Bytes> McapReader::records_of(const Section& section) const {
  auto bytes = read_bytes(section.offset, section.length);
  if (!bytes || !section.is_chunk) return bytes;
  ByteReader in(*bytes);
  const bool is_chunk = in.u8() == static_cast<std::uint8_t>(Opcode::kChunk);
  in.raw(8 + 8 + 8);
  const std::uint64_t size = in.u64();
  const std::uint32_t crc = in.u32();
  const std::string compression = in.text();
  const ByteSpan packed = in.raw(in.u64());
  const std::string where = path_ + ": the chunk at byte " + std::to_string(section.offset);
  if (!is_chunk || !in.ok()) return Error{where + " is damaged and left out"};
  auto records = mcap::decompress(compression, packed, size);
  if (!records) return Error{where + " is left out: " + records.error()};
  if (crc != 0 && mcap::crc32(*records) != crc) {
    return Error{where + " is left out: its checksum is wrong"};
  }
  return records;
}

Result<McapReader::Loaded> McapReader::load(const Section& section) {
  auto records = records_of(section);
  if (!records) return records.failure();
  Loaded loaded;
  loaded.records = std::move(*records);
  if (auto done = index_records(&loaded, section); !done) return done.failure();
  return loaded;
}

Result<void> McapReader::index_records(Loaded* loaded, const Section& section) {
  std::size_t strangers = 0;
  const bool whole = for_each_record(loaded->records, [&](Opcode opcode, ByteSpan body) {
    mcap::Schema schema;
    mcap::Channel channel;
    if (opcode == Opcode::kSchema && from_body(body, &schema)) {
      schemas_.emplace(schema.id, std::move(schema));
    } else if (opcode == Opcode::kChannel && from_body(body, &channel)) {
      channels_.emplace(channel.id, std::move(channel));
    } else if (opcode == Opcode::kMessage && body.size() >= kMessageHead) {
      ByteReader in(body);
      const std::uint16_t id = in.u16();
      in.u32();
      if (!channels_.contains(id)) {
        ++strangers;
        return;
      }
      const auto offset = static_cast<std::uint64_t>(body.data() - loaded->records.data());
      loaded->entries.push_back({in.u64(), offset, body.size()});
    }
  });
  const std::string where = path_ + ": the chunk at byte " + std::to_string(section.offset);
  if (!whole) return Error{where + " is left out: a record in it goes beyond its end"};
  if (strangers > 0) {
    notes_.push_back(where + " has " + std::to_string(strangers) +
                     " messages of unknown channels; they are left out");
  }
  std::stable_sort(loaded->entries.begin(), loaded->entries.end(),
                   [](const Entry& a, const Entry& b) { return a.log_ns < b.log_ns; });
  return {};
}

Result<Bytes> McapReader::read_attachment(const mcap::AttachmentIndex& attachment) const {
  const auto record = read_bytes(attachment.offset, attachment.length);
  if (!record) return record.failure();
  ByteReader in(*record);
  const bool is_attachment = in.u8() == static_cast<std::uint8_t>(Opcode::kAttachment);
  in.raw(8 + 8 + 8);
  in.text();
  in.text();
  const ByteSpan data = in.raw(in.u64());
  const std::uint32_t crc = in.u32();
  if (!is_attachment || !in.ok()) {
    return Error{path_ + ": attachment '" + attachment.name + "' is damaged"};
  }
  const ByteSpan checked(record->data() + kRecordHeaderSize,
                         record->size() - kRecordHeaderSize - in.left() - 4);
  if (crc != 0 && mcap::crc32(checked) != crc) {
    return Error{path_ + ": the checksum of attachment '" + attachment.name + "' is wrong"};
  }
  return Bytes(data.begin(), data.end());
}

std::optional<std::map<std::string, std::string>> McapReader::metadata(
    const std::string& name) const {
  const auto found = std::find_if(metadata_.rbegin(), metadata_.rend(),
                                  [&](const auto& index) { return index.name == name; });
  if (found == metadata_.rend()) return std::nullopt;
  const auto record = read_bytes(found->offset, found->length);
  if (!record) return std::nullopt;
  ByteReader in(*record);
  in.raw(kRecordHeaderSize);
  in.text();
  auto values = in.text_map();
  if (!in.ok()) return std::nullopt;
  return values;
}

void McapReader::seek(std::uint64_t log_ns, ChannelFilter filter) {
  from_ns_ = log_ns;
  filter_ = std::move(filter);
  next_section_ = 0;
  loaded_.clear();
  current_.reset();
}

bool McapReader::wants(const Section& section) const {
  if (section.end_ns < from_ns_) return false;
  if (!filter_ || section.channels.empty()) return true;
  return std::any_of(section.channels.begin(), section.channels.end(), [&](const auto& entry) {
    const auto channel = channels_.find(entry.first);
    return channel == channels_.end() || filter_(channel->second);
  });
}

bool McapReader::wants(const Loaded& loaded, const Entry& entry) const {
  if (entry.log_ns < from_ns_) return false;
  ByteReader in(ByteSpan(loaded.records).subspan(entry.offset, entry.length));
  return !filter_ || filter_(channels_.at(in.u16()));
}

/// Loads every section that may hold the next message.
void McapReader::load_due_sections() {
  const auto first_time = [](const auto& loaded) { return loaded->entries[loaded->next].log_ns; };
  while (next_section_ < sections_.size()) {
    const Section& section = sections_[next_section_];
    std::uint64_t soonest = std::numeric_limits<std::uint64_t>::max();
    std::uint64_t held = 0;
    for (const auto& loaded : loaded_) {
      soonest = std::min(soonest, first_time(loaded));
      held += loaded->records.size();
    }
    if (!loaded_.empty() && (section.start_ns > soonest || held > kMostLoaded)) return;
    ++next_section_;
    if (!wants(section)) continue;
    auto loaded = load(section);
    if (!loaded) {
      notes_.push_back(loaded.error());
      continue;
    }
    auto& entries = loaded->entries;
    const auto unwanted = [&](const Entry& entry) { return !wants(*loaded, entry); };
    entries.erase(std::remove_if(entries.begin(), entries.end(), unwanted), entries.end());
    if (!entries.empty()) loaded_.push_back(std::make_unique<Loaded>(std::move(*loaded)));
  }
}

std::optional<McapMessage> McapReader::next() {
  current_.reset();
  load_due_sections();
  if (loaded_.empty()) return std::nullopt;
  const auto soonest =
      std::min_element(loaded_.begin(), loaded_.end(), [](const auto& a, const auto& b) {
        return a->entries[a->next].log_ns < b->entries[b->next].log_ns;
      });
  Loaded& loaded = **soonest;
  const Entry entry = loaded.entries[loaded.next++];
  ByteReader in(ByteSpan(loaded.records).subspan(entry.offset, entry.length));
  McapMessage message;
  message.channel = &channels_.at(in.u16());
  message.sequence = in.u32();
  message.log_ns = in.u64();
  message.publish_ns = in.u64();
  message.data = in.raw(in.left());
  if (loaded.next == loaded.entries.size()) {
    current_ = std::move(*soonest);
    loaded_.erase(soonest);
  }
  return message;
}

}  // namespace sovo
