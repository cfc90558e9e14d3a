#include "sovo/bridge/dashboard/foxglove_protocol.h"

#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

namespace sovo::bridge::foxglove {
namespace {

using nlohmann::json;

constexpr std::uint8_t kMessageData = 0x01;
constexpr std::uint8_t kClientMessageData = 0x01;
constexpr std::size_t kMostItems = 1000;

/// Text with bytes that are no UTF-8 replaced: names on the bus can hold anything.
std::string dump(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

void append_little_endian(std::uint64_t value, int bytes, std::string* out) {
  for (int i = 0; i < bytes; ++i) out->push_back(static_cast<char>(value >> (8 * i) & 0xFFU));
}

std::optional<std::uint32_t> number(const json& value) {
  if (!value.is_number_unsigned()) return std::nullopt;
  const auto n = value.get<std::uint64_t>();
  if (n > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  return static_cast<std::uint32_t>(n);
}

std::optional<std::uint32_t> number(const json& object, const char* key) {
  const auto at = object.find(key);
  return at == object.end() ? std::nullopt : number(*at);
}

std::string text(const json& object, const char* key) {
  const auto at = object.find(key);
  return at != object.end() && at->is_string() ? at->get<std::string>() : "";
}

/// The array `key`, with at most kMostItems elements.
const json* list(const json& object, const char* key) {
  const auto at = object.find(key);
  if (at == object.end() || !at->is_array() || at->size() > kMostItems) return nullptr;
  return &*at;
}

Error malformed(const std::string& op) { return Error{"malformed '" + op + "'"}; }

Result<ClientText> parse_subscribe(const json& object) {
  const json* items = list(object, "subscriptions");
  if (items == nullptr) return malformed("subscribe");
  Subscribe result;
  for (const json& item : *items) {
    if (!item.is_object()) return malformed("subscribe");
    const auto id = number(item, "id");
    const auto channel = number(item, "channelId");
    if (!id || !channel) return malformed("subscribe");
    result.items.push_back({*id, *channel});
  }
  return ClientText(std::move(result));
}

Result<ClientText> parse_advertise(const json& object) {
  const json* items = list(object, "channels");
  if (items == nullptr) return malformed("advertise");
  ClientAdvertise result;
  for (const json& item : *items) {
    if (!item.is_object()) return malformed("advertise");
    const auto id = number(item, "id");
    if (!id) return malformed("advertise");
    result.items.push_back(
        {*id, text(item, "topic"), text(item, "encoding"), text(item, "schemaName")});
  }
  return ClientText(std::move(result));
}

/// The numbers of array `key`.
std::optional<std::vector<std::uint32_t>> numbers(const json& object, const char* key) {
  const json* items = list(object, key);
  if (items == nullptr) return std::nullopt;
  std::vector<std::uint32_t> result;
  for (const json& item : *items) {
    const auto id = number(item);
    if (!id) return std::nullopt;
    result.push_back(*id);
  }
  return result;
}

}  // namespace

std::optional<std::string> choose_subprotocol(std::string_view offered) {
  while (!offered.empty()) {
    const auto comma = offered.find(',');
    std::string_view one = offered.substr(0, comma);
    while (one.starts_with(' ')) one.remove_prefix(1);
    while (one.ends_with(' ')) one.remove_suffix(1);
    for (const char* ours : kSubprotocols) {
      if (one == ours) return std::string(one);
    }
    if (comma == std::string_view::npos) break;
    offered.remove_prefix(comma + 1);
  }
  return std::nullopt;
}

std::string server_info(const std::string& name, const std::string& session, bool client_publish) {
  json info = {{"op", "serverInfo"},
               {"name", name},
               {"capabilities", json::array()},
               {"supportedEncodings", json::array({"cdr"})},
               {"metadata", json::object()},
               {"sessionId", session}};
  if (client_publish) info["capabilities"].push_back("clientPublish");
  return dump(info);
}

std::string advertise(std::span<const Channel> channels) {
  json list_of = json::array();
  for (const Channel& channel : channels) {
    list_of.push_back({{"id", channel.id},
                       {"topic", channel.topic},
                       {"encoding", "cdr"},
                       {"schemaName", channel.type},
                       {"schema", channel.schema},
                       {"schemaEncoding", "ros2msg"}});
  }
  return dump({{"op", "advertise"}, {"channels", std::move(list_of)}});
}

std::string unadvertise(std::span<const std::uint32_t> channels) {
  return dump({{"op", "unadvertise"},
               {"channelIds", std::vector<std::uint32_t>(channels.begin(), channels.end())}});
}

std::string status(Level level, const std::string& message, const std::string& id) {
  json value = {{"op", "status"}, {"level", static_cast<int>(level)}, {"message", message}};
  if (!id.empty()) value["id"] = id;
  return dump(value);
}

std::string message_head(std::uint32_t subscription, std::int64_t stamp_ns) {
  std::string head(1, static_cast<char>(kMessageData));
  append_little_endian(subscription, 4, &head);
  append_little_endian(static_cast<std::uint64_t>(stamp_ns), 8, &head);
  return head;
}

Result<ClientText> parse_text(std::string_view message) {
  // Deep nesting would cost stack where the value is destroyed; nothing here nests deeper.
  int depth = 0;
  const json object = json::parse(
      message,
      [&depth](int at, json::parse_event_t, json&) {
        depth = std::max(depth, at);
        return at < 8;
      },
      false);
  if (!object.is_object() || depth >= 8) return Error{"not a JSON object"};
  const std::string op = text(object, "op");
  if (op == "subscribe") return parse_subscribe(object);
  if (op == "advertise") return parse_advertise(object);
  if (op == "unsubscribe") {
    auto ids = numbers(object, "subscriptionIds");
    if (!ids) return malformed(op);
    return ClientText(Unsubscribe{std::move(*ids)});
  }
  if (op == "unadvertise") {
    auto ids = numbers(object, "channelIds");
    if (!ids) return malformed(op);
    return ClientText(ClientUnadvertise{std::move(*ids)});
  }
  if (op.empty() || op.size() > 64) return Error{"a message without 'op'"};
  return ClientText(Unsupported{op});
}

Result<ClientMessage> parse_binary(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kHead = 5;
  if (bytes.size() < kHead || bytes[0] != kClientMessageData) {
    return Error{"a binary message that is no client message"};
  }
  ClientMessage message;
  for (unsigned i = 0; i < 4; ++i) message.channel |= std::uint32_t{bytes[1 + i]} << (8U * i);
  message.payload = bytes.subspan(kHead);
  return message;
}

}  // namespace sovo::bridge::foxglove
