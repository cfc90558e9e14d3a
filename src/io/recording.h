#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sovo/io/mcap_reader.h"

namespace sovo {

/// Metadata record with the number of messages, by topic, that a file repeats of those before it.
inline constexpr char kRepeatedRecord[] = "sovo_repeated";

/// A channel of a recording: topic, type and quality of service as they were.
struct RecordedTopic {
  std::string topic;  ///< Full ROS name.
  std::string type;   ///< "nav_msgs/msg/Odometry"
  std::string definition;
  std::string type_hash;       ///< Empty when it was not recorded.
  std::string offered_qos;     ///< YAML of ROS 2's bags; empty when it was not recorded.
  std::uint64_t messages = 0;  ///< Without those that are repeated.
  std::uint64_t repeated = 0;  ///< Again in a further file, so that it stands alone.
};

struct RecordedMessage {
  const RecordedTopic* topic = nullptr;
  std::uint64_t log_ns = 0;
  std::uint64_t publish_ns = 0;
  ByteSpan data;  ///< CDR with its encapsulation header; valid until the next message is read.
};

/// A recording: one MCAP file, or a folder of them as ROS 2's bags have them.
///
///     auto recording = Recording::open("dive");
///     while (auto message = (*recording)->next()) { ... }
///
/// What a file repeats of those before it (see RecordingWriter) is given once. Messages that are
/// not CDR of a "ros2msg" type are left out and noted.
class Recording {
 public:
  static Result<std::unique_ptr<Recording>> open(const std::string& path);

  /// By name, in alphabetical order.
  const std::map<std::string, RecordedTopic>& topics() const { return topics_; }
  const RecordedTopic* find(const std::string& topic) const;
  /// The only topic of a type; null when there is none, or more than one.
  const RecordedTopic* only_topic_of(const std::string& type) const;

  std::uint64_t messages() const { return messages_; }
  std::uint64_t start_ns() const { return start_ns_; }
  std::uint64_t end_ns() const { return end_ns_; }
  double duration_s() const { return static_cast<double>(end_ns_ - start_ns_) * 1e-9; }
  const std::vector<std::unique_ptr<McapReader>>& files() const { return files_; }
  /// What is wrong with the files, for people; grows while they are read.
  std::vector<std::string> notes() const;

  using TopicFilter = std::function<bool(const RecordedTopic&)>;
  /// Goes to the first message received at or after `log_ns`, of the topics that `filter` takes.
  void seek(std::uint64_t log_ns, const TopicFilter& filter = {});
  /// The next message; nothing at the end.
  std::optional<RecordedMessage> next();

 private:
  Recording() = default;
  void add(std::unique_ptr<McapReader> file);
  void add_topic(const McapReader& file, const mcap::Channel& channel);
  void find_repeated();
  bool is_repeated(const std::string& topic);

  std::vector<std::unique_ptr<McapReader>> files_;
  std::map<std::string, RecordedTopic> topics_;
  std::vector<std::string> notes_;
  std::uint64_t messages_ = 0;
  std::uint64_t start_ns_ = 0;
  std::uint64_t end_ns_ = 0;
  std::size_t file_ = 0;
  using Counts = std::map<std::string, std::uint64_t>;  // by topic
  std::vector<Counts> repeated_;                        // by file
  std::vector<Counts> still_repeated_;                  // and not yet passed
};

/// Paths of the MCAP files of a recording, in order: the file itself, or those of the folder.
Result<std::vector<std::string>> recording_files(const std::string& path);

}  // namespace sovo
