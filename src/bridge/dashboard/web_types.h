#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace sovo::bridge {

/// What the server needs to know of an HTTP request; header fields are empty when absent.
struct WebRequest {
  std::string method;
  std::string path;   ///< Without the query.
  std::string query;  ///< Without '?', not decoded.
  std::string host;
  std::string origin;
  std::string cookie;
  std::string authorization;
  std::string subprotocols;  ///< Sec-WebSocket-Protocol.
  std::string if_none_match;
  bool tls = false;
};

struct WebResponse {
  unsigned status = 200;
  std::string content_type = "text/plain; charset=utf-8";
  std::string body;
  std::vector<std::pair<std::string, std::string>> headers;
};

/// Bytes that many queues may share.
using SharedBytes = std::shared_ptr<const std::vector<std::uint8_t>>;

/// One WebSocket message to send: `head`, then `payload` when there is one.
struct WebFrame {
  bool text = false;
  std::string head;
  SharedBytes payload;
};

/// The socket of a client, as its owner sees it.
class WebSocketHandle {
 public:
  virtual ~WebSocketHandle() = default;
  /// There is something to send: `WebClient::next` is asked soon. May be called from any thread.
  virtual void wake() = 0;
};

/// One WebSocket connection, as the server sees it. All calls come from the server's thread.
class WebClient {
 public:
  virtual ~WebClient() = default;
  virtual void opened(std::shared_ptr<WebSocketHandle> socket) = 0;
  /// False: the message breaks the protocol and the connection is closed.
  virtual bool receive_text(std::string_view message) = 0;
  virtual bool receive_binary(std::span<const std::uint8_t> message) = 0;
  /// The next message to send, as soon as the one before has gone.
  virtual std::optional<WebFrame> next() = 0;
  virtual void closed() = 0;
};

/// A WebSocket that may be opened.
struct WebUpgrade {
  std::string subprotocol;
  std::shared_ptr<WebClient> client;
};

/// Answers requests; called from the server's thread.
class WebHandler {
 public:
  virtual ~WebHandler() = default;
  virtual WebResponse respond(const WebRequest& request) = 0;
  /// Lets the connection become a WebSocket, or says why not.
  virtual std::variant<WebUpgrade, WebResponse> upgrade(const WebRequest& request) = 0;
};

}  // namespace sovo::bridge
