#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "sovo/bridge/raw_reader.h"
#include "sovo/bridge/topic_discovery.h"
#include "sovo/io/recording_writer.h"

namespace sovo::bridge {

/// A topic of which messages are captured.
struct CapturedTopic {
  RecordingTopic about;
  const MessageSchema* schema = nullptr;
  TopicQos qos;
};

/// Takes the messages of many topics as they come, on a thread of its own.
///
/// The default set is every topic of the catalog that is not on demand; others are named below the
/// namespace or with a leading slash, "all" is every topic of a known type, and a name after "-" is
/// left out.
class TopicCapture {
 public:
  /// Called from the capturing thread; must not block.
  using Sink =
      std::function<void(const std::shared_ptr<const CapturedTopic>&, CdrSample, std::int64_t)>;

  static Result<std::unique_ptr<TopicCapture>> open(const Participant& participant,
                                                    const std::vector<std::string>& more_topics,
                                                    Sink sink);
  ~TopicCapture();

  /// Topics that were asked for and whose type is not known, as "/topic (type)".
  std::vector<std::string> unknown() const;
  /// Why capturing ended, or empty.
  std::string failure() const;

 private:
  struct Source {
    std::shared_ptr<const CapturedTopic> topic;
    std::unique_ptr<RawReader> reader;
    DdsHandle condition;
  };

  TopicCapture(const Participant& participant, TopicDiscovery discovery, Sink sink)
      : participant_(participant), discovery_(std::move(discovery)), sink_(std::move(sink)) {}

  Result<void> open_waitset();
  Result<void> add(const std::string& ros_name, const MessageSchema& schema, const TopicQos& qos);
  Result<void> follow_discovery();
  bool is_wanted(const std::string& ros_name) const;
  Result<void> take_all();
  void run();

  const Participant& participant_;
  TopicDiscovery discovery_;
  Sink sink_;
  std::set<std::string> wanted_;    // full names
  std::set<std::string> unwanted_;  // full names; these win
  bool all_ = false;
  std::map<std::string, Source> sources_;
  DdsHandle guard_;
  DdsHandle waitset_;

  mutable std::mutex mutex_;  // of unknown_ and failure_
  std::set<std::string> unknown_;
  std::string failure_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace sovo::bridge
