#include "sovo/io/recording.h"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "sovo/io/text.h"

namespace sovo {
namespace {

namespace fs = std::filesystem;

constexpr char kCdr[] = "cdr";
constexpr char kRos2Msg[] = "ros2msg";

/// Number at the end of "dive_12"; files are split in its order.
std::uint64_t split_number(const fs::path& path) {
  const std::string stem = path.stem().string();
  const auto begin = stem.find_last_not_of("0123456789") + 1;
  std::uint64_t number = 0;
  for (std::size_t i = begin; i < stem.size() && i < begin + 18; ++i) {
    number = number * 10 + static_cast<std::uint64_t>(stem[i] - '0');
  }
  return number;
}

std::string value_of(const mcap::Channel& channel, const std::string& key) {
  const auto found = channel.metadata.find(key);
  return found == channel.metadata.end() ? "" : found->second;
}

}  // namespace

Result<std::vector<std::string>> recording_files(const std::string& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) {
    if (!fs::exists(path, error)) return Error{path + " does not exist"};
    return std::vector<std::string>{path};
  }
  std::vector<fs::path> found;
  for (const auto& entry : fs::directory_iterator(path, error)) {
    if (entry.path().extension() == ".mcap") found.push_back(entry.path());
  }
  if (error) return Error{path + " cannot be read: " + error.message()};
  if (found.empty()) return Error{path + " holds no .mcap file"};
  std::sort(found.begin(), found.end(), [](const fs::path& a, const fs::path& b) {
    return std::pair(split_number(a), a) < std::pair(split_number(b), b);
  });
  return std::vector<std::string>(found.begin(), found.end());
}

Result<std::unique_ptr<Recording>> Recording::open(const std::string& path) {
  const auto paths = recording_files(path);
  if (!paths) return paths.failure();
  std::unique_ptr<Recording> recording(new Recording());
  for (const std::string& file : *paths) {
    auto reader = McapReader::open(file);
    if (!reader) return reader.failure();
    recording->add(std::move(*reader));
  }
  std::stable_sort(recording->files_.begin(), recording->files_.end(),
                   [](const auto& a, const auto& b) {
                     return a->statistics().start_ns < b->statistics().start_ns;
                   });
  recording->find_repeated();
  recording->seek(0);
  return recording;
}

void Recording::find_repeated() {
  repeated_.resize(files_.size());
  for (std::size_t i = 1; i < files_.size(); ++i) {
    const auto counts = files_[i]->metadata(kRepeatedRecord);
    if (!counts) continue;
    for (const auto& [name, text] : *counts) {
      const auto topic = topics_.find(name);
      const auto count = parse_integer(text);
      if (topic == topics_.end() || !count || *count <= 0) continue;
      const std::uint64_t most =
          std::min(static_cast<std::uint64_t>(*count), topic->second.messages);
      repeated_[i][name] = most;
      topic->second.messages -= most;
      topic->second.repeated += most;
      messages_ -= std::min(messages_, most);
    }
  }
}

/// Whether the next message of the topic in the current file is one of an earlier file.
bool Recording::is_repeated(const std::string& topic) {
  const auto left = still_repeated_[file_].find(topic);
  if (left == still_repeated_[file_].end() || left->second == 0) return false;
  --left->second;
  return true;
}

void Recording::add(std::unique_ptr<McapReader> file) {
  for (const auto& [id, channel] : file->channels()) add_topic(*file, channel);
  const mcap::Statistics& statistics = file->statistics();
  if (statistics.messages > 0) {
    start_ns_ = messages_ == 0 ? statistics.start_ns : std::min(start_ns_, statistics.start_ns);
    end_ns_ = std::max(end_ns_, statistics.end_ns);
    messages_ += statistics.messages;
  }
  files_.push_back(std::move(file));
}

void Recording::add_topic(const McapReader& file, const mcap::Channel& channel) {
  const auto schema = file.schemas().find(channel.schema_id);
  const bool known = schema != file.schemas().end() && schema->second.encoding == kRos2Msg &&
                     channel.message_encoding == kCdr;
  if (!known) {
    notes_.push_back(file.path() + ": " + channel.topic + " is left out: its messages are '" +
                     channel.message_encoding + "', not CDR of a ROS 2 type");
    return;
  }
  RecordedTopic& topic = topics_[channel.topic];
  topic.topic = channel.topic;
  topic.type = schema->second.name;
  topic.definition = schema->second.data;
  if (topic.type_hash.empty()) topic.type_hash = value_of(channel, "topic_type_hash");
  if (topic.offered_qos.empty()) topic.offered_qos = value_of(channel, "offered_qos_profiles");
  const auto count = file.statistics().channel_messages.find(channel.id);
  if (count != file.statistics().channel_messages.end()) topic.messages += count->second;
}

const RecordedTopic* Recording::find(const std::string& topic) const {
  const auto found = topics_.find(topic);
  return found == topics_.end() ? nullptr : &found->second;
}

const RecordedTopic* Recording::only_topic_of(const std::string& type) const {
  const RecordedTopic* only = nullptr;
  for (const auto& [name, topic] : topics_) {
    if (topic.type != type) continue;
    if (only != nullptr) return nullptr;
    only = &topic;
  }
  return only;
}

std::vector<std::string> Recording::notes() const {
  std::vector<std::string> notes = notes_;
  for (const auto& file : files_) {
    notes.insert(notes.end(), file->notes().begin(), file->notes().end());
  }
  return notes;
}

void Recording::seek(std::uint64_t log_ns, const TopicFilter& filter) {
  file_ = 0;
  still_repeated_ = repeated_;
  for (std::size_t i = 0; i < files_.size(); ++i) {
    if (log_ns > files_[i]->statistics().start_ns) still_repeated_[i].clear();
  }
  for (const auto& file : files_) {
    file->seek(log_ns, [this, filter](const mcap::Channel& channel) {
      const RecordedTopic* topic = find(channel.topic);
      return topic != nullptr && (!filter || filter(*topic));
    });
  }
}

std::optional<RecordedMessage> Recording::next() {
  while (file_ < files_.size()) {
    const auto message = files_[file_]->next();
    if (!message) {
      ++file_;
      continue;
    }
    if (is_repeated(message->channel->topic)) continue;
    return RecordedMessage{find(message->channel->topic), message->log_ns, message->publish_ns,
                           message->data};
  }
  return std::nullopt;
}

}  // namespace sovo
