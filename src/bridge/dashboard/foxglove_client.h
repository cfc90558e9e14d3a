#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "sovo/bridge/dashboard/client_queue.h"
#include "sovo/bridge/dashboard/foxglove_hub.h"
#include "sovo/bridge/dashboard/foxglove_protocol.h"

namespace sovo::bridge {

/// One connection of a page or of Foxglove. Everything it has is guarded by the hub's mutex.
class FoxgloveClient : public WebClient {
 public:
  explicit FoxgloveClient(FoxgloveHub& hub);

  void opened(std::shared_ptr<WebSocketHandle> socket) override;
  bool receive_text(std::string_view message) override;
  bool receive_binary(std::span<const std::uint8_t> message) override;
  std::optional<WebFrame> next() override;
  void closed() override;

  // For the hub, with its mutex held.
  void tell(std::string text);
  void send(QueuedMessage message);
  /// The channel of a subscription has gone.
  void forget(std::uint32_t subscription);
  std::size_t queued_bytes() const { return queue_.bytes(); }

 private:
  using Clock = std::chrono::steady_clock;

  bool accept(const foxglove::Subscribe& request);
  bool accept(const foxglove::Unsubscribe& request);
  bool accept(const foxglove::ClientAdvertise& request);
  bool accept(const foxglove::ClientUnadvertise& request);
  bool accept(const foxglove::Unsupported& request);
  void complain(const std::string& what);
  void tell_what_was_missed();
  bool refuse();

  FoxgloveHub& hub_;
  std::shared_ptr<WebSocketHandle> socket_;
  std::deque<std::string> texts_;
  ClientQueue queue_;
  std::map<std::uint32_t, std::string> subscriptions_;  // with the topic's name
  std::map<std::uint32_t, foxglove::ClientAdvertise::Item> published_;
  std::map<std::string, std::uint64_t> missed_;  // by topic
  Clock::time_point told_missed_;
};

}  // namespace sovo::bridge
