#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "sovo/bridge/dashboard/client_queue.h"
#include "sovo/io/result.h"

// Foxglove's WebSocket protocol, version 1: text messages are JSON objects with an "op", binary
// ones carry data. Little endian.
namespace sovo::bridge::foxglove {

/// Both name the same messages.
inline constexpr const char* kSubprotocols[] = {"foxglove.sdk.v1", "foxglove.websocket.v1"};

/// The first of the client's subprotocols ("a, b") that the server speaks.
std::optional<std::string> choose_subprotocol(std::string_view offered);

/// A topic that clients can subscribe to.
struct Channel {
  std::uint32_t id = 0;
  std::string topic;
  std::string type;    ///< "nav_msgs/msg/Odometry"
  std::string schema;  ///< ros2msg text with all that it needs.
  Importance importance = Importance::kState;
  int latched_depth = 0;  ///< Messages that a late subscriber gets; 0: none.
};

enum class Level { kInfo = 0, kWarning = 1, kError = 2 };

std::string server_info(const std::string& name, const std::string& session, bool client_publish);
std::string advertise(std::span<const Channel> channels);
std::string unadvertise(std::span<const std::uint32_t> channels);
std::string status(Level level, const std::string& message, const std::string& id = "");
/// What stands before the payload of a binary message.
std::string message_head(std::uint32_t subscription, std::int64_t stamp_ns);

// What clients say.

struct Subscribe {
  struct Item {
    std::uint32_t subscription = 0;
    std::uint32_t channel = 0;
  };
  std::vector<Item> items;
};
struct Unsubscribe {
  std::vector<std::uint32_t> subscriptions;
};
struct ClientAdvertise {
  struct Item {
    std::uint32_t id = 0;
    std::string topic;
    std::string encoding;
    std::string type;
  };
  std::vector<Item> items;
};
struct ClientUnadvertise {
  std::vector<std::uint32_t> ids;
};
/// An operation that the server does not offer.
struct Unsupported {
  std::string op;
};
using ClientText =
    std::variant<Subscribe, Unsubscribe, ClientAdvertise, ClientUnadvertise, Unsupported>;

/// The error says what is malformed.
Result<ClientText> parse_text(std::string_view text);

/// A message that a client publishes; `payload` points into what was parsed.
struct ClientMessage {
  std::uint32_t channel = 0;
  std::span<const std::uint8_t> payload;
};
Result<ClientMessage> parse_binary(std::span<const std::uint8_t> bytes);

}  // namespace sovo::bridge::foxglove
