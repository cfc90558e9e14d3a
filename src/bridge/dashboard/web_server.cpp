#include "sovo/bridge/dashboard/web_server.h"

#include <array>
#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <optional>
#include <set>
#include <thread>
#include <utility>

#include "sovo/bridge/dashboard/web_stream.h"
#include "sovo/io/text.h"

// The only file that sees Boost.Beast, with web_stream.h: it takes the compiler half a minute.

namespace sovo::bridge {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
namespace ssl = asio::ssl;
using tcp = asio::ip::tcp;
using boost::system::error_code;

constexpr std::chrono::seconds kRequestTimeout(20);
constexpr std::chrono::seconds kGoodbyeTimeout(5);
constexpr std::uint32_t kMaxHeaderBytes = 16U << 10U;
constexpr std::uint64_t kMaxBodyBytes = 1024;

using Request = http::request<http::string_body>;

std::string text(beast::string_view view) { return std::string(view.data(), view.size()); }

WebRequest to_request(const Request& request, bool tls) {
  WebRequest result;
  result.method = text(request.method_string());
  const std::string target = text(request.target());
  const auto question = target.find('?');
  result.path = target.substr(0, question);
  if (question != std::string::npos) result.query = target.substr(question + 1);
  result.host = text(request[http::field::host]);
  result.origin = text(request[http::field::origin]);
  result.cookie = text(request[http::field::cookie]);
  result.authorization = text(request[http::field::authorization]);
  result.subprotocols = text(request[http::field::sec_websocket_protocol]);
  result.if_none_match = text(request[http::field::if_none_match]);
  result.tls = tls;
  return result;
}

http::response<http::string_body> to_response(WebResponse answer, const Request& request) {
  http::response<http::string_body> response(static_cast<http::status>(answer.status),
                                             request.version());
  response.set(http::field::content_type, answer.content_type);
  for (const auto& [name, value] : answer.headers) response.insert(name, value);
  response.keep_alive(request.keep_alive());
  const std::size_t size = answer.body.size();
  if (request.method() != http::verb::head) response.body() = std::move(answer.body);
  response.content_length(size);
  return response;
}

/// What connections share.
struct Context {
  explicit Context(WebHandler& h) : handler(h) {}

  WebHandler& handler;
  WebServerConfig config;
  std::atomic<std::size_t> connections = 0;
  std::set<std::shared_ptr<WebClient>> clients;  ///< Of open WebSockets.
  asio::io_context io{1};                        ///< Last: connections that it holds use the rest.
};

/// Counts a connection while it lives.
class ConnectionCount {
 public:
  explicit ConnectionCount(Context& context) : context_(&context) { ++context.connections; }
  ConnectionCount(ConnectionCount&& other) noexcept
      : context_(std::exchange(other.context_, nullptr)) {}
  ConnectionCount& operator=(ConnectionCount&&) = delete;
  ~ConnectionCount() {
    if (context_ != nullptr) --context_->connections;
  }

 private:
  Context* context_;
};

/// A WebSocket: reads until it ends, writes one message at a time when there is one.
class WebSocketConnection : public WebSocketHandle,
                            public std::enable_shared_from_this<WebSocketConnection> {
 public:
  WebSocketConnection(WebStream stream, Context& context, WebUpgrade upgrade, ConnectionCount count)
      : socket_(std::move(stream)),
        context_(context),
        upgrade_(std::move(upgrade)),
        count_(std::move(count)) {}

  void start(const Request& request) {
    socket_.next_layer().tcp().expires_never();
    auto timeout = websocket::stream_base::timeout::suggested(beast::role_type::server);
    timeout.idle_timeout = std::chrono::seconds(60);
    timeout.keep_alive_pings = true;
    timeout.handshake_timeout = kGoodbyeTimeout;
    socket_.set_option(timeout);
    socket_.read_message_max(context_.config.max_message_bytes);
    socket_.set_option(websocket::stream_base::decorator([this](websocket::response_type& r) {
      r.set(http::field::sec_websocket_protocol, upgrade_.subprotocol);
    }));
    socket_.async_accept(request, [self = shared_from_this()](error_code error) {
      if (error) return;
      self->context_.clients.insert(self->upgrade_.client);
      self->upgrade_.client->opened(self);
      self->read();
    });
  }

  void wake() override {
    if (waking_.exchange(true)) return;
    asio::post(context_.io, [self = shared_from_this()] {
      self->waking_ = false;
      self->write();
    });
  }

 private:
  void read() {
    socket_.async_read(buffer_, [self = shared_from_this()](error_code error, std::size_t) {
      if (error) return self->end();
      const auto data = self->buffer_.data();
      const auto* bytes = static_cast<const std::uint8_t*>(data.data());
      const std::span<const std::uint8_t> message(bytes, data.size());
      auto& client = *self->upgrade_.client;
      const bool fine =
          self->socket_.got_text()
              ? client.receive_text({static_cast<const char*>(data.data()), data.size()})
              : client.receive_binary(message);
      self->buffer_.consume(self->buffer_.size());
      if (!fine) return self->close();
      self->read();
    });
  }

  /// One that broke the protocol is a client no more, however long it takes to say goodbye.
  void close() {
    closing_ = true;
    forget();
    socket_.async_close(websocket::close_code::protocol_error,
                        [self = shared_from_this()](error_code) { self->end(); });
  }

  void write() {
    if (writing_ || closing_ || ended_) return;
    auto frame = upgrade_.client->next();
    if (!frame) return;
    frame_ = std::move(*frame);
    writing_ = true;
    socket_.text(frame_.text);
    const std::array<asio::const_buffer, 2> parts = {
        asio::buffer(frame_.head),
        frame_.payload ? asio::buffer(*frame_.payload) : asio::const_buffer()};
    socket_.async_write(parts, [self = shared_from_this()](error_code error, std::size_t) {
      self->writing_ = false;
      if (error) return self->end();
      self->write();
    });
  }

  void forget() {
    if (context_.clients.erase(upgrade_.client) > 0) upgrade_.client->closed();
  }

  void end() {
    if (std::exchange(ended_, true)) return;
    forget();
    socket_.next_layer().tcp().cancel();
  }

  websocket::stream<WebStream> socket_;
  Context& context_;
  WebUpgrade upgrade_;
  ConnectionCount count_;
  beast::flat_buffer buffer_;
  WebFrame frame_;
  std::atomic<bool> waking_ = false;
  bool writing_ = false;
  bool closing_ = false;
  bool ended_ = false;
};

/// Requests of one connection, one after another, until it becomes a WebSocket or ends.
class HttpConnection : public std::enable_shared_from_this<HttpConnection> {
 public:
  HttpConnection(WebStream stream, Context& context)
      : stream_(std::move(stream)), context_(context), count_(context) {}

  void start() {
    if (!stream_.has_tls()) return read();
    stream_.tcp().expires_after(kRequestTimeout);
    stream_.async_handshake([self = shared_from_this()](error_code error) {
      if (!error) self->read();
    });
  }

 private:
  void read() {
    parser_.emplace();
    parser_->header_limit(kMaxHeaderBytes);
    parser_->body_limit(kMaxBodyBytes);
    stream_.tcp().expires_after(kRequestTimeout);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](error_code error, std::size_t) {
                       if (!error) self->answer();
                     });
  }

  void answer() {
    const Request& request = parser_->get();
    const WebRequest asked = to_request(request, stream_.has_tls());
    if (!websocket::is_upgrade(request)) return write(context_.handler.respond(asked));
    auto decision = context_.handler.upgrade(asked);
    if (auto* refusal = std::get_if<WebResponse>(&decision)) return write(std::move(*refusal));
    std::make_shared<WebSocketConnection>(
        std::move(stream_), context_, std::get<WebUpgrade>(std::move(decision)), std::move(count_))
        ->start(request);
  }

  void write(WebResponse answer) {
    response_ = to_response(std::move(answer), parser_->get());
    stream_.tcp().expires_after(kRequestTimeout);
    http::async_write(stream_, response_,
                      [self = shared_from_this()](error_code error, std::size_t) {
                        if (error) return;
                        if (self->response_.keep_alive()) return self->read();
                        error_code ignored;
                        self->stream_.tcp().socket().shutdown(tcp::socket::shutdown_send, ignored);
                      });
  }

  WebStream stream_;
  Context& context_;
  ConnectionCount count_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::string_body>> parser_;
  http::response<http::string_body> response_;
};

std::string where(const WebServerConfig& config) {
  return config.address + ":" + std::to_string(config.port);
}

}  // namespace

class WebServer::Impl {
 public:
  explicit Impl(WebHandler& handler) : context_(handler), acceptor_(context_.io) {}

  ~Impl() {
    context_.io.stop();
    if (thread_.joinable()) thread_.join();
    // A client and its connection hold each other until it is closed.
    for (const auto& client : context_.clients) client->closed();
    context_.clients.clear();
  }

  Result<void> listen(const WebServerConfig& config) {
    context_.config = config;
    if (auto done = read_certificate(); !done) return done.failure();
    error_code error;
    const std::string name = config.address == "localhost" ? "127.0.0.1" : config.address;
    const auto address = asio::ip::make_address(name, error);
    if (error) {
      return Error{"'" + config.address +
                   "' is no address; give one of this machine's, or 0.0.0.0"};
    }
    const tcp::endpoint endpoint(address, config.port);
    acceptor_.open(endpoint.protocol(), error);
    if (!error) acceptor_.set_option(asio::socket_base::reuse_address(true), error);
    if (!error) acceptor_.bind(endpoint, error);
    if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
    if (error) {
      return Error{"cannot listen on " + where(config) + ": " + error.message() +
                   "; --listen ADDRESS:PORT chooses another"};
    }
    port_ = acceptor_.local_endpoint().port();
    accept();
    thread_ = std::thread([this] { context_.io.run(); });
    return {};
  }

  std::uint16_t port() const { return port_; }

 private:
  Result<void> read_certificate() {
    const WebServerConfig& config = context_.config;
    if (config.tls_cert.empty()) return {};
    // Of a file that is not there, the library says little.
    for (const std::string& path : {config.tls_cert, config.tls_key}) {
      if (const auto text = read_text_file(path); !text) return Error{"TLS: " + text.error()};
    }
    tls_.emplace(ssl::context::tls_server);
    error_code error;
    tls_->set_options(ssl::context::default_workarounds | ssl::context::no_sslv2 |
                      ssl::context::no_sslv3 | ssl::context::no_tlsv1 | ssl::context::no_tlsv1_1);
    tls_->use_certificate_chain_file(config.tls_cert, error);
    if (error) return Error{"TLS certificate " + config.tls_cert + ": " + error.message()};
    // Nobody is there to be asked for a passphrase.
    tls_->set_password_callback([](std::size_t, auto) { return std::string(); }, error);
    tls_->use_private_key_file(config.tls_key, ssl::context::pem, error);
    if (error) {
      return Error{"TLS key " + config.tls_key + ": " + error.message() +
                   ": it must belong to the certificate and have no passphrase"};
    }
    return {};
  }

  void accept() {
    acceptor_.async_accept([this](error_code error, tcp::socket socket) {
      if (!acceptor_.is_open()) return;
      if (error) {
        // Out of file descriptors, say: no reason to spin.
        retry_.expires_after(std::chrono::milliseconds(100));
        retry_.async_wait([this](error_code) { accept(); });
        return;
      }
      if (context_.connections < context_.config.max_connections) serve(std::move(socket));
      accept();
    });
  }

  void serve(tcp::socket socket) {
    error_code ignored;
    socket.set_option(tcp::no_delay(true), ignored);
    // What the kernel keeps for a stalled client is not under this program's rule of what to drop.
    socket.set_option(asio::socket_base::send_buffer_size(512 << 10), ignored);
    WebStream stream = tls_ ? WebStream(std::move(socket), *tls_) : WebStream(std::move(socket));
    std::make_shared<HttpConnection>(std::move(stream), context_)->start();
  }

  Context context_;
  std::optional<ssl::context> tls_;
  tcp::acceptor acceptor_;
  asio::steady_timer retry_{context_.io};
  std::uint16_t port_ = 0;
  std::thread thread_;
};

WebServer::WebServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
WebServer::~WebServer() = default;

Result<std::unique_ptr<WebServer>> WebServer::open(const WebServerConfig& config,
                                                   WebHandler& handler) {
  auto impl = std::make_unique<Impl>(handler);
  if (auto done = impl->listen(config); !done) return done.failure();
  return std::unique_ptr<WebServer>(new WebServer(std::move(impl)));
}

std::uint16_t WebServer::port() const { return impl_->port(); }

}  // namespace sovo::bridge
