#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sovo/bridge/dashboard/foxglove_protocol.h"
#include "sovo/bridge/dashboard/message_bus.h"

namespace sovo::bridge {

class FoxgloveClient;

/// What the hub did since it began, and has now.
struct HubCounters {
  std::size_t clients = 0;
  std::size_t channels = 0;
  std::size_t queued_bytes = 0;
  std::uint64_t forwarded = 0;  ///< Messages given to a client's queue.
  std::uint64_t missed = 0;     ///< Messages that slow clients did not get.
  std::uint64_t commands = 0;   ///< Published for clients.
  std::uint64_t malformed = 0;  ///< Messages of clients that closed their connection.
};

struct HubConfig {
  bool allow_commands = false;
  std::size_t queue_bytes = 8U << 20U;  ///< That wait for one client at most.
};

/// Joins a bus and the clients that speak Foxglove's protocol: who subscribed to what, and what
/// late subscribers of latched topics get. Safe for several threads.
class FoxgloveHub : public BusListener {
 public:
  FoxgloveHub(MessageBus& bus, const HubConfig& config);

  /// A client to be connected.
  std::shared_ptr<WebClient> make_client();
  HubCounters counters() const;

  void on_channel(const foxglove::Channel& channel) override;
  void on_channel_gone(std::uint32_t channel) override;
  void on_message(std::uint32_t channel, std::int64_t stamp_ns, SharedBytes payload) override;

 private:
  friend class FoxgloveClient;

  struct Latched {
    std::int64_t stamp_ns;
    SharedBytes payload;
  };
  /// A channel, and who listens: each client under a subscription number of its own.
  struct Topic {
    foxglove::Channel channel;
    std::vector<std::pair<FoxgloveClient*, std::uint32_t>> subscribers;
    std::deque<Latched> latched;
  };

  // All below are called with the mutex held.
  void add(FoxgloveClient* client);
  void remove(FoxgloveClient* client);
  /// False when there is no such channel.
  bool subscribe(FoxgloveClient* client, std::uint32_t subscription, std::uint32_t channel);
  void unsubscribe(FoxgloveClient* client, std::uint32_t subscription);
  void stop_if_unused(Topic* topic);

  MessageBus& bus_;
  const HubConfig config_;
  const std::string session_;
  mutable std::mutex mutex_;
  std::map<std::uint32_t, Topic> topics_;
  std::set<FoxgloveClient*> clients_;
  HubCounters totals_;
};

}  // namespace sovo::bridge
