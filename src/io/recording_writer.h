#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sovo/io/mcap_writer.h"
#include "sovo/io/recording_config.h"

namespace sovo {

/// What a recording says of a topic.
struct RecordingTopic {
  std::string topic;
  std::string type;  ///< "nav_msgs/msg/Odometry"
  std::string definition;
  std::string type_hash;
  std::string offered_qos;  ///< YAML as ROS 2's bags have it.
  /// Messages that a late reader would get; they are repeated at the start of every further file.
  std::size_t latched = 0;
};

/// Writes a recording: "x.mcap" is that file alone; another path becomes a folder with
/// PATH/NAME_0.mcap, further files, and metadata.yaml, which opens as a ROS 2 bag.
///
/// Each file stands alone: it begins with attachments and with what late readers of latched topics
/// would get. The metadata record `sovo_repeated` counts those by topic.
///
/// Everything older than a second is in a closed chunk on its way to the disk, given that `tick` is
/// called often. For one thread.
class RecordingWriter {
 public:
  static Result<std::unique_ptr<RecordingWriter>> create(const std::string& path,
                                                         const RecordingConfig& config);

  /// Number of the topic for `write`.
  std::size_t add_topic(const RecordingTopic& topic);
  /// That of the topic of this name, added when it is new.
  std::size_t topic_number(const RecordingTopic& topic);
  Result<void> write(std::size_t topic, std::uint64_t log_ns, std::uint64_t publish_ns,
                     ByteSpan data);
  /// To be stored in every file from now on.
  Result<void> attach(const std::string& name, const std::string& media_type, std::uint64_t log_ns,
                      Bytes data);
  /// Drops by topic, to be stored when they change.
  void set_drops(std::map<std::string, std::uint64_t> drops) { drops_ = std::move(drops); }
  /// Closes a chunk that is a second old; fails when the disk is nearly full.
  Result<void> tick();
  /// Finishes files and metadata.
  Result<void> close();

  /// File that is written now.
  const std::string& file() const { return file_path_; }
  std::uint64_t bytes() const;
  std::uint64_t messages() const;

 private:
  RecordingWriter(std::string path, const RecordingConfig& config, bool is_folder)
      : path_(std::move(path)), config_(config), is_folder_(is_folder) {}

  struct File {
    std::string name;
    mcap::Statistics statistics;
    std::uint64_t bytes = 0;
  };
  struct Attachment {
    std::string name;
    std::string media_type;
    std::uint64_t log_ns = 0;
    Bytes data;
  };
  struct Latched {
    std::uint32_t sequence = 0;
    std::uint64_t publish_ns = 0;
    Bytes data;
  };
  struct Topic {
    RecordingTopic about;
    std::optional<std::uint16_t> channel;  ///< In the file that is written now.
    std::uint32_t sequence = 0;
    std::uint64_t messages = 0;
    std::uint64_t repeated = 0;
    std::deque<Latched> latched;
  };

  Result<void> open_file();
  Result<void> split(std::uint64_t log_ns);
  Result<void> repeat_latched(std::uint64_t log_ns);
  Result<void> close_file();
  Result<void> store_drops();
  std::uint16_t channel_of(Topic& topic);
  Result<void> write_metadata() const;

  std::string path_;
  RecordingConfig config_;
  bool is_folder_;
  std::string file_path_;
  std::unique_ptr<McapWriter> writer_;
  std::map<std::string, std::uint16_t> schemas_;  // of the file that is written now
  std::vector<Topic> topics_;
  std::vector<Attachment> attachments_;
  std::vector<File> files_;           // those that are closed
  std::uint64_t repeated_bytes_ = 0;  // of the file that is written now
  std::map<std::string, std::uint64_t> drops_;
  std::map<std::string, std::uint64_t> stored_drops_;
  std::chrono::steady_clock::time_point last_flush_ = std::chrono::steady_clock::now();
};

/// metadata.yaml of a folder of MCAP files that are there already, as `sovo recover` needs it.
Result<void> write_bag_metadata(const std::string& folder);

/// Bytes left on the disk of a path, for users without privileges.
std::uint64_t free_bytes(const std::string& path);

}  // namespace sovo
