#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sovo/bridge/dashboard/message_bus.h"
#include "sovo/bridge/dds_config.h"

namespace sovo::bridge {

class DomainFeed;

/// The topics of one or more DDS domains, of all namespaces: those of known types but stereo frames
/// and full images, which would fill a vehicle's tether. A topic is read only while it is wanted.
/// With more than one domain, topics are named /domain_N/....
class DdsBus : public MessageBus {
 public:
  /// Joins `domains`; when there are none, the one that `config` says.
  static Result<std::unique_ptr<DdsBus>> open(const DdsConfig& config,
                                              const std::vector<int>& domains);
  ~DdsBus() override;

  /// Lines for the log at start.
  std::vector<std::string> notes() const;

  void start(BusListener& listener) override;
  void stop() override;
  void want(std::uint32_t channel, bool wanted) override;
  Result<void> prepare(const std::string& topic, const std::string& type) override;
  Result<void> publish(const std::string& topic, std::span<const std::uint8_t> payload) override;
  std::string metrics() override;

 private:
  DdsBus() = default;
  /// The domain of a topic, with its name there.
  std::pair<DomainFeed*, std::string> feed_of(const std::string& topic) const;

  std::vector<std::unique_ptr<DomainFeed>> feeds_;
};

}  // namespace sovo::bridge
