#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "sovo/bridge/dashboard/foxglove_protocol.h"
#include "sovo/bridge/dashboard/web_types.h"
#include "sovo/io/result.h"

namespace sovo::bridge {

/// Hears what a bus has; called from the bus' threads, never from within a call to the bus.
class BusListener {
 public:
  virtual ~BusListener() = default;
  virtual void on_channel(const foxglove::Channel& channel) = 0;
  virtual void on_channel_gone(std::uint32_t channel) = 0;
  /// `payload`: CDR with its encapsulation header.
  virtual void on_message(std::uint32_t channel, std::int64_t stamp_ns, SharedBytes payload) = 0;
};

/// Where the dashboard's messages come from.
class MessageBus {
 public:
  virtual ~MessageBus() = default;
  /// Tells the listener of everything from now on; call once.
  virtual void start(BusListener& listener) = 0;
  /// Tells the listener nothing any more.
  virtual void stop() = 0;
  /// Messages of the channel are wanted, or no longer. Unknown channels are ignored.
  virtual void want(std::uint32_t channel, bool wanted) = 0;
  /// Gets ready to publish commands on a topic. The error says why that cannot be.
  virtual Result<void> prepare(const std::string& topic, const std::string& type) = 0;
  /// Publishes a serialized command on a prepared topic. The error says why not.
  virtual Result<void> publish(const std::string& topic, std::span<const std::uint8_t> payload) = 0;
  /// Lines of Prometheus text about the vehicles.
  virtual std::string metrics() = 0;
};

}  // namespace sovo::bridge
