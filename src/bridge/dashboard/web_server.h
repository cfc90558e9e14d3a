#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "sovo/bridge/dashboard/web_types.h"
#include "sovo/io/result.h"

namespace sovo::bridge {

struct WebServerConfig {
  std::string address = "127.0.0.1";  ///< "localhost" is 127.0.0.1.
  std::uint16_t port = 8765;          ///< 0: a free one.
  std::string tls_cert;               ///< PEM files; both empty: no TLS.
  std::string tls_key;
  std::size_t max_connections = 64;
  std::size_t max_message_bytes = 64U << 10U;  ///< Of a client's WebSocket message.
};

/// HTTP and WebSocket on one port, with a thread of its own. It knows nothing of what is served;
/// connections that break the protocol, send too much or too slowly are closed.
class WebServer {
 public:
  /// Listens and serves until the object ends. The handler must outlive it.
  static Result<std::unique_ptr<WebServer>> open(const WebServerConfig& config,
                                                 WebHandler& handler);
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  std::uint16_t port() const;

 private:
  class Impl;
  explicit WebServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace sovo::bridge
