#include "sovo/bridge/dashboard/dds_bus.h"

#include <algorithm>
#include <atomic>
#include <map>

#include "sovo/bridge/dashboard/domain_feed.h"

namespace sovo::bridge {

DdsBus::~DdsBus() = default;

Result<std::unique_ptr<DdsBus>> DdsBus::open(const DdsConfig& config,
                                             const std::vector<int>& domains) {
  std::unique_ptr<DdsBus> bus(new DdsBus());
  std::vector<int> all = domains.empty() ? std::vector<int>{config.domain} : domains;
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  const auto ids = std::make_shared<std::atomic<std::uint32_t>>(0);
  for (const int domain : all) {
    DdsConfig one = config;
    one.domain = domain;
    const std::string prefix = all.size() > 1 ? "/domain_" + std::to_string(domain) : "";
    auto feed = DomainFeed::open(one, prefix, ids);
    if (!feed) return feed.failure();
    bus->feeds_.push_back(std::move(*feed));
  }
  return bus;
}

std::vector<std::string> DdsBus::notes() const {
  std::vector<std::string> result;
  for (const auto& feed : feeds_) {
    const auto& notes = feed->notes();
    result.insert(result.end(), notes.begin(), notes.end());
  }
  return result;
}

void DdsBus::start(BusListener& listener) {
  for (const auto& feed : feeds_) feed->start(listener);
}

void DdsBus::stop() {
  for (const auto& feed : feeds_) feed->stop();
}

void DdsBus::want(std::uint32_t channel, bool wanted) {
  for (const auto& feed : feeds_) feed->want(channel, wanted);
}

std::pair<DomainFeed*, std::string> DdsBus::feed_of(const std::string& topic) const {
  for (const auto& feed : feeds_) {
    const std::string& prefix = feed->prefix();
    if (prefix.empty() || topic.starts_with(prefix + "/")) {
      return {feed.get(), topic.substr(prefix.size())};
    }
  }
  return {nullptr, topic};
}

Result<void> DdsBus::prepare(const std::string& topic, const std::string& type) {
  const auto [feed, name] = feed_of(topic);
  if (feed == nullptr) return Error{"there is no domain of " + topic};
  return feed->prepare(name, type);
}

Result<void> DdsBus::publish(const std::string& topic, std::span<const std::uint8_t> payload) {
  const auto [feed, name] = feed_of(topic);
  if (feed == nullptr) return Error{"there is no domain of " + topic};
  return feed->publish(name, payload);
}

std::string DdsBus::metrics() {
  std::multimap<std::string, std::string> samples;
  for (const auto& feed : feeds_) feed->collect(&samples);
  std::string text;
  std::string last;
  for (const auto& [name, sample] : samples) {
    if (name != last) {
      text += "# TYPE " + name + (name.ends_with("_total") ? " counter\n" : " gauge\n");
      last = name;
    }
    text += sample;
  }
  return text;
}

}  // namespace sovo::bridge
