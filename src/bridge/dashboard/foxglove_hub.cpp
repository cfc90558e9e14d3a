#include "sovo/bridge/dashboard/foxglove_hub.h"

#include <algorithm>

#include "sovo/bridge/dashboard/foxglove_client.h"
#include "sovo/bridge/dashboard/web_access.h"

namespace sovo::bridge {

FoxgloveHub::FoxgloveHub(MessageBus& bus, const HubConfig& config)
    : bus_(bus), config_(config), session_(random_hex(8)) {}

std::shared_ptr<WebClient> FoxgloveHub::make_client() {
  return std::make_shared<FoxgloveClient>(*this);
}

HubCounters FoxgloveHub::counters() const {
  const std::lock_guard lock(mutex_);
  HubCounters counters = totals_;
  counters.clients = clients_.size();
  counters.channels = topics_.size();
  for (const FoxgloveClient* client : clients_) counters.queued_bytes += client->queued_bytes();
  return counters;
}

void FoxgloveHub::on_channel(const foxglove::Channel& channel) {
  const std::lock_guard lock(mutex_);
  topics_[channel.id].channel = channel;
  for (FoxgloveClient* client : clients_) client->tell(foxglove::advertise({&channel, 1}));
}

void FoxgloveHub::on_channel_gone(std::uint32_t channel) {
  const std::lock_guard lock(mutex_);
  const auto at = topics_.find(channel);
  if (at == topics_.end()) return;
  for (const auto& [client, subscription] : at->second.subscribers) client->forget(subscription);
  topics_.erase(at);
  for (FoxgloveClient* client : clients_) client->tell(foxglove::unadvertise({&channel, 1}));
}

void FoxgloveHub::on_message(std::uint32_t channel, std::int64_t stamp_ns, SharedBytes payload) {
  const std::lock_guard lock(mutex_);
  const auto at = topics_.find(channel);
  if (at == topics_.end()) return;
  Topic& topic = at->second;
  if (topic.channel.latched_depth > 0) {
    topic.latched.push_back({stamp_ns, payload});
    if (topic.latched.size() > static_cast<std::size_t>(topic.channel.latched_depth)) {
      topic.latched.pop_front();
    }
  }
  for (const auto& [client, subscription] : topic.subscribers) {
    ++totals_.forwarded;
    client->send({subscription, stamp_ns, topic.channel.importance, payload});
  }
}

void FoxgloveHub::add(FoxgloveClient* client) {
  clients_.insert(client);
  std::vector<foxglove::Channel> channels;
  for (const auto& [id, topic] : topics_) channels.push_back(topic.channel);
  client->tell(foxglove::server_info("sovo dashboard", session_, config_.allow_commands));
  if (!channels.empty()) client->tell(foxglove::advertise(channels));
}

void FoxgloveHub::remove(FoxgloveClient* client) {
  clients_.erase(client);
  for (auto& [id, topic] : topics_) {
    std::erase_if(topic.subscribers, [client](const auto& s) { return s.first == client; });
    stop_if_unused(&topic);
  }
}

bool FoxgloveHub::subscribe(FoxgloveClient* client, std::uint32_t subscription,
                            std::uint32_t channel) {
  const auto at = topics_.find(channel);
  if (at == topics_.end()) return false;
  Topic& topic = at->second;
  topic.subscribers.emplace_back(client, subscription);
  if (topic.subscribers.size() == 1) bus_.want(channel, true);
  for (const Latched& message : topic.latched) {
    ++totals_.forwarded;
    client->send({subscription, message.stamp_ns, topic.channel.importance, message.payload});
  }
  return true;
}

void FoxgloveHub::unsubscribe(FoxgloveClient* client, std::uint32_t subscription) {
  for (auto& [id, topic] : topics_) {
    std::erase(topic.subscribers, std::pair(client, subscription));
    stop_if_unused(&topic);
  }
}

void FoxgloveHub::stop_if_unused(Topic* topic) {
  if (!topic->subscribers.empty()) return;
  bus_.want(topic->channel.id, false);
  // The next reader gets them from the writer again.
  topic->latched.clear();
}

}  // namespace sovo::bridge
