#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "sovo/bridge/dashboard/message_bus.h"
#include "sovo/bridge/dashboard/vehicle_metrics.h"
#include "sovo/bridge/dds_handle.h"
#include "sovo/bridge/participant.h"
#include "sovo/bridge/raw_reader.h"
#include "sovo/bridge/raw_writer.h"

namespace sovo::bridge {

/// The topics of one DDS domain: finds out who writes what, and reads what is wanted, with a thread
/// of its own.
class DomainFeed {
 public:
  using Ids = std::shared_ptr<std::atomic<std::uint32_t>>;

  /// `prefix` stands before the names of its channels, whose numbers come from `ids`.
  static Result<std::unique_ptr<DomainFeed>> open(const DdsConfig& config,
                                                  const std::string& prefix, Ids ids);
  ~DomainFeed();
  DomainFeed(const DomainFeed&) = delete;
  DomainFeed& operator=(const DomainFeed&) = delete;

  const std::string& prefix() const { return prefix_; }
  const std::vector<std::string>& notes() const { return participant_.notes(); }

  void start(BusListener& listener);
  void stop();
  // As MessageBus has them; topics without the prefix.
  void want(std::uint32_t channel, bool wanted);
  Result<void> prepare(const std::string& topic, const std::string& type);
  Result<void> publish(const std::string& topic, std::span<const std::uint8_t> payload);
  void collect(std::multimap<std::string, std::string>* samples) { metrics_.collect(samples); }

 private:
  /// A topic of one type.
  struct Source {
    foxglove::Channel channel;
    std::string topic;  // without the prefix
    const MessageSchema* schema = nullptr;
    TopicQos qos;
    std::set<std::string> writers;  // by GUID
    bool wanted = false;
    std::shared_ptr<RawReader> reader;
  };
  using Key = std::pair<std::string, std::string>;  // topic, type

  DomainFeed(Participant participant, std::string prefix, Ids ids)
      : participant_(std::move(participant)), prefix_(std::move(prefix)), ids_(std::move(ids)) {}

  Result<void> open_discovery();
  void run();
  void discover();
  void add_writer(const dds_builtintopic_endpoint_t& writer);
  void remove_writer(const dds_builtintopic_endpoint_t& writer);
  std::vector<std::pair<std::uint32_t, std::shared_ptr<RawReader>>> update_readers();
  void forward();

  Participant participant_;
  const std::string prefix_;
  const Ids ids_;
  BusListener* listener_ = nullptr;
  VehicleMetrics metrics_;

  DdsHandle waitset_;
  DdsHandle discovery_;
  DdsHandle guard_;

  // Only the thread uses these.
  std::map<std::string, Key> writers_;  // by GUID

  std::mutex mutex_;
  std::map<Key, Source> sources_;
  std::map<std::string, RawWriter> commands_;

  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace sovo::bridge
