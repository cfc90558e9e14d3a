#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sovo/io/mcap_format.h"

namespace sovo {

/// A message of a recording; `data` is valid until the next one is read.
struct McapMessage {
  const mcap::Channel* channel = nullptr;
  std::uint32_t sequence = 0;
  std::uint64_t log_ns = 0;
  std::uint64_t publish_ns = 0;
  ByteSpan data;
};

/// Reads an MCAP file of any writer in the order of log times.
///
///     auto reader = McapReader::open("dive.mcap");
///     for (const std::string& note : reader->notes()) { /* damage */ }
///     while (auto message = (*reader)->next()) { ... }
///
/// The index at the end is used when it is whole; otherwise the file is read through at `open`, and
/// everything before its first cut is given. Broken chunks are left out and noted.
class McapReader {
 public:
  static Result<std::unique_ptr<McapReader>> open(const std::string& path);
  ~McapReader();
  McapReader(const McapReader&) = delete;
  McapReader& operator=(const McapReader&) = delete;

  /// By id. Without an index: those of the messages.
  const std::map<std::uint16_t, mcap::Schema>& schemas() const { return schemas_; }
  const std::map<std::uint16_t, mcap::Channel>& channels() const { return channels_; }
  const mcap::Statistics& statistics() const { return statistics_; }
  const std::vector<mcap::AttachmentIndex>& attachments() const { return attachments_; }
  /// Whether the file has a whole index.
  bool is_indexed() const { return indexed_; }
  /// What is wrong with the file, for people; grows while it is read.
  const std::vector<std::string>& notes() const { return notes_; }
  const std::string& path() const { return path_; }

  Result<Bytes> read_attachment(const mcap::AttachmentIndex& attachment) const;
  /// Metadata records of a name; of several the last one.
  std::optional<std::map<std::string, std::string>> metadata(const std::string& name) const;

  using ChannelFilter = std::function<bool(const mcap::Channel&)>;
  /// Goes to the first message at or after `log_ns` of the channels that `filter` takes.
  void seek(std::uint64_t log_ns, ChannelFilter filter = {});
  /// The next message; nothing at the end.
  std::optional<McapMessage> next();

 private:
  /// A chunk, or a run of records that are in none.
  struct Section {
    std::uint64_t offset = 0;  ///< Of the chunk's record, or of the first record.
    std::uint64_t length = 0;
    std::uint64_t start_ns = 0;
    std::uint64_t end_ns = 0;
    bool is_chunk = true;
    std::map<std::uint16_t, std::uint64_t> channels;  ///< Empty: not known.
  };
  struct Entry {
    std::uint64_t log_ns = 0;
    std::uint64_t offset = 0;  ///< Of the message's body in the section.
    std::uint64_t length = 0;
  };
  /// A section in memory, its messages in the order of time.
  struct Loaded {
    Bytes records;
    std::vector<Entry> entries;
    std::size_t next = 0;
  };

  McapReader(std::string path, int file, std::uint64_t size);

  bool read_at(std::uint64_t offset, std::uint8_t* to, std::size_t size) const;
  Result<Bytes> read_bytes(std::uint64_t offset, std::uint64_t size) const;
  Result<void> check_magic() const;
  bool load_summary();
  bool take_summary(ByteSpan records);
  void scan();
  std::uint64_t scan_record(mcap::Opcode opcode, std::uint64_t offset, std::uint64_t body);
  void note_plain(std::uint64_t offset, std::uint64_t length, mcap::Opcode opcode);
  void count_sections();
  Result<Bytes> records_of(const Section& section) const;
  Result<Loaded> load(const Section& section);
  Result<void> index_records(Loaded* loaded, const Section& section);
  bool wants(const Section& section) const;
  bool wants(const Loaded& loaded, const Entry& entry) const;
  void load_due_sections();

  std::string path_;
  int file_;
  std::uint64_t size_;
  bool indexed_ = false;
  std::map<std::uint16_t, mcap::Schema> schemas_;
  std::map<std::uint16_t, mcap::Channel> channels_;
  mcap::Statistics statistics_;
  std::vector<mcap::AttachmentIndex> attachments_;
  std::vector<mcap::MetadataIndex> metadata_;
  std::vector<std::string> notes_;

  std::vector<Section> sections_;  // in the order of start times
  std::size_t next_section_ = 0;
  std::uint64_t from_ns_ = 0;
  ChannelFilter filter_;
  std::vector<std::unique_ptr<Loaded>> loaded_;
  std::unique_ptr<Loaded> current_;  // of the message given last, when nothing else is in it
};

}  // namespace sovo
