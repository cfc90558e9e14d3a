#include "sovo/io/recording_writer.h"

#include <sys/statvfs.h>

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "sovo/io/bag_metadata.h"
#include "sovo/io/recording.h"
#include "sovo/io/text.h"

namespace sovo {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kLongestChunk(800);  // with what `tick` is late, below a second
constexpr char kDrops[] = "sovo_drops";

}  // namespace

std::uint64_t free_bytes(const std::string& path) {
  struct statvfs status {};
  fs::path there = fs::absolute(path);
  std::error_code error;
  while (!fs::exists(there, error) && there.has_relative_path()) there = there.parent_path();
  if (::statvfs(there.c_str(), &status) != 0) return 0;
  return std::uint64_t{status.f_bavail} * status.f_frsize;
}

Result<std::unique_ptr<RecordingWriter>> RecordingWriter::create(const std::string& path,
                                                                 const RecordingConfig& config) {
  std::string plain = path;
  while (plain.size() > 1 && plain.back() == '/') plain.pop_back();
  const bool is_folder = fs::path(plain).extension() != ".mcap";
  std::error_code error;
  if (fs::exists(plain, error)) {
    return Error{plain + " exists; a recording is never overwritten: give another name"};
  }
  if (is_folder) {
    fs::create_directories(plain, error);
    if (error) return Error{plain + " cannot be made: " + error.message()};
  }
  std::unique_ptr<RecordingWriter> writer(new RecordingWriter(plain, config, is_folder));
  if (auto opened = writer->open_file(); !opened) return opened.failure();
  if (auto written = writer->write_metadata(); !written) return written.failure();
  return writer;
}

Result<void> RecordingWriter::open_file() {
  file_path_ = path_;
  if (is_folder_) {
    const std::string stem = fs::path(path_).filename().string();
    file_path_ = path_ + "/" + stem + "_" + std::to_string(files_.size()) + ".mcap";
  }
  McapWriterConfig config;
  config.compression = config_.compression;
  config.chunk_bytes = std::max<std::uint64_t>(config_.chunk_bytes, 1);
  auto writer = McapWriter::create(file_path_, config);
  if (!writer) return writer.failure();
  writer_ = std::move(*writer);
  repeated_bytes_ = 0;
  schemas_.clear();
  stored_drops_.clear();
  for (Topic& topic : topics_) topic.channel.reset();
  for (const Attachment& a : attachments_) {
    if (auto done = writer_->attach(a.name, a.media_type, a.log_ns, a.data); !done) return done;
  }
  return {};
}

std::size_t RecordingWriter::add_topic(const RecordingTopic& topic) {
  topics_.push_back({topic, std::nullopt, 0, 0, 0, {}});
  return topics_.size() - 1;
}

std::size_t RecordingWriter::topic_number(const RecordingTopic& topic) {
  const auto found = std::find_if(topics_.begin(), topics_.end(), [&topic](const Topic& known) {
    return known.about.topic == topic.topic && known.about.type == topic.type;
  });
  if (found == topics_.end()) return add_topic(topic);
  return static_cast<std::size_t>(found - topics_.begin());
}

Result<void> RecordingWriter::split(std::uint64_t log_ns) {
  if (auto done = close_file(); !done) return done;
  if (auto done = open_file(); !done) return done;
  if (auto done = repeat_latched(log_ns); !done) return done;
  return write_metadata();
}

/// Gives the file what late readers would have got before its first message.
Result<void> RecordingWriter::repeat_latched(std::uint64_t log_ns) {
  std::map<std::string, std::string> counts;
  for (const Topic& topic : topics_) {
    if (!topic.latched.empty()) counts[topic.about.topic] = std::to_string(topic.latched.size());
  }
  if (counts.empty()) return {};
  if (auto done = writer_->add_metadata(kRepeatedRecord, counts); !done) return done;
  const std::uint64_t before = writer_->bytes();
  for (Topic& topic : topics_) {
    topic.repeated += topic.latched.size();
    for (const Latched& message : topic.latched) {
      auto done = writer_->write(channel_of(topic), message.sequence, log_ns, message.publish_ns,
                                 message.data);
      if (!done) return done;
    }
  }
  repeated_bytes_ = writer_->bytes() - before;
  return {};
}

std::uint16_t RecordingWriter::channel_of(Topic& topic) {
  if (topic.channel) return *topic.channel;
  const RecordingTopic& about = topic.about;
  auto schema = schemas_.find(about.type);
  if (schema == schemas_.end()) {
    const auto id = writer_->add_schema(about.type, "ros2msg", about.definition);
    schema = schemas_.emplace(about.type, id).first;
  }
  std::map<std::string, std::string> metadata = {{"offered_qos_profiles", about.offered_qos}};
  if (!about.type_hash.empty()) metadata["topic_type_hash"] = about.type_hash;
  topic.channel = writer_->add_channel(schema->second, about.topic, metadata);
  return *topic.channel;
}

Result<void> RecordingWriter::write(std::size_t index, std::uint64_t log_ns,
                                    std::uint64_t publish_ns, ByteSpan data) {
  if (!writer_) return Error{path_ + " is closed"};
  const std::uint64_t most = config_.split_bytes;
  if (is_folder_ && most > 0 && writer_->bytes() >= most + repeated_bytes_ && messages() > 0) {
    if (auto done = split(log_ns); !done) return done;
  }
  Topic& topic = topics_[index];
  auto done = writer_->write(channel_of(topic), topic.sequence, log_ns, publish_ns, data);
  if (!done) return done;
  if (is_folder_ && most > 0 && topic.about.latched > 0) {
    topic.latched.push_back({topic.sequence, publish_ns, Bytes(data.begin(), data.end())});
    if (topic.latched.size() > topic.about.latched) topic.latched.pop_front();
  }
  ++topic.sequence;
  ++topic.messages;
  return {};
}

Result<void> RecordingWriter::attach(const std::string& name, const std::string& media_type,
                                     std::uint64_t log_ns, Bytes data) {
  auto done = writer_->attach(name, media_type, log_ns, data);
  attachments_.push_back({name, media_type, log_ns, std::move(data)});
  return done;
}

Result<void> RecordingWriter::store_drops() {
  if (drops_ == stored_drops_) return {};
  std::map<std::string, std::string> values;
  for (const auto& [topic, count] : drops_) values[topic] = std::to_string(count);
  stored_drops_ = drops_;
  return writer_->add_metadata(kDrops, values);
}

Result<void> RecordingWriter::tick() {
  if (!writer_) return Error{path_ + " is closed"};
  const auto now = Clock::now();
  if (now - last_flush_ < kLongestChunk) return {};
  last_flush_ = now;
  if (auto done = writer_->flush(); !done) return done;
  if (auto done = store_drops(); !done) return done;
  const std::uint64_t left = free_bytes(path_);
  if (left >= config_.min_free_bytes) return {};
  const auto megabytes = [](std::uint64_t bytes) {
    return format_fixed(static_cast<double>(bytes) * 1e-6, 0) + " MB";
  };
  return Error{"the disk of " + path_ + " has " + megabytes(left) + " left, less than " +
               megabytes(config_.min_free_bytes) + ": free some, or ask for less with --min-free"};
}

Result<void> RecordingWriter::close_file() {
  if (auto done = writer_->flush(); !done) return done;
  if (auto done = store_drops(); !done) return done;
  if (auto done = writer_->close(); !done) return done;
  files_.push_back(
      {fs::path(file_path_).filename().string(), writer_->statistics(), writer_->bytes()});
  writer_.reset();
  return {};
}

Result<void> RecordingWriter::close() {
  if (!writer_) return {};
  auto closed = close_file();
  if (!closed) {  // it reads all the same, up to its last chunk
    files_.push_back(
        {fs::path(file_path_).filename().string(), writer_->statistics(), writer_->bytes()});
  }
  writer_.reset();
  const auto written = write_metadata();
  return closed ? written : closed;
}

std::uint64_t RecordingWriter::bytes() const {
  std::uint64_t sum = writer_ ? writer_->bytes() : 0;
  for (const File& file : files_) sum += file.bytes;
  return sum;
}

std::uint64_t RecordingWriter::messages() const {
  std::uint64_t sum = 0;
  for (const Topic& topic : topics_) sum += topic.messages;
  return sum;
}

Result<void> RecordingWriter::write_metadata() const {
  if (!is_folder_) return {};
  BagMetadata metadata;
  for (const Topic& topic : topics_) {
    if (topic.messages == 0) continue;
    metadata.topics.push_back({topic.about.topic, topic.about.type, topic.about.offered_qos,
                               topic.messages + topic.repeated});
  }
  for (const File& file : files_) {
    metadata.files.push_back(
        {file.name, file.statistics.start_ns, file.statistics.end_ns, file.statistics.messages});
  }
  if (writer_) metadata.files.push_back({fs::path(file_path_).filename().string(), 0, 0, 0});
  return write_text_file(path_ + "/metadata.yaml", to_yaml(metadata));
}

Result<void> write_bag_metadata(const std::string& folder) {
  const auto recording = Recording::open(folder);
  if (!recording) return recording.failure();
  BagMetadata metadata;
  for (const auto& [name, topic] : (*recording)->topics()) {
    metadata.topics.push_back(
        {name, topic.type, topic.offered_qos, topic.messages + topic.repeated});
  }
  for (const auto& file : (*recording)->files()) {
    metadata.files.push_back({fs::path(file->path()).filename().string(),
                              file->statistics().start_ns, file->statistics().end_ns,
                              file->statistics().messages});
  }
  return write_text_file(folder + "/metadata.yaml", to_yaml(metadata));
}

}  // namespace sovo
