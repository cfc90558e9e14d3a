#pragma once

#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <boost/beast/websocket/teardown.hpp>
#include <cstddef>
#include <memory>
#include <utility>

namespace sovo::bridge {

/// A completion handler whose type is forgotten: what is called with it is compiled once.
template <class... Arguments>
class AnyHandler {
 public:
  template <class Handler>
  explicit AnyHandler(Handler handler)
      : held_(std::make_unique<Held<Handler>>(std::move(handler))) {}

  void operator()(Arguments... arguments) { held_->call(arguments...); }

 private:
  struct Base {
    virtual ~Base() = default;
    virtual void call(Arguments... arguments) = 0;
  };
  template <class Handler>
  struct Held final : Base {
    explicit Held(Handler h) : handler(std::move(h)) {}
    void call(Arguments... arguments) override { handler(arguments...); }
    Handler handler;
  };

  std::unique_ptr<Base> held_;
};

/// A TCP connection with TLS or without, as one type: the machinery of HTTP and of WebSockets above
/// it is compiled once, which is half a minute less. For an io_context of one thread: handlers run
/// on it, whatever executor is associated with them.
class WebStream {
 public:
  using Tcp = boost::beast::tcp_stream;
  using Tls = boost::beast::ssl_stream<Tcp>;
  using executor_type = Tcp::executor_type;
  using Error = boost::system::error_code;

  explicit WebStream(boost::asio::ip::tcp::socket socket)
      : tcp_(std::make_unique<Tcp>(std::move(socket))) {}
  WebStream(boost::asio::ip::tcp::socket socket, boost::asio::ssl::context& context)
      : tls_(std::make_unique<Tls>(std::move(socket), context)) {}

  bool has_tls() const { return tls_ != nullptr; }
  Tcp& tcp() { return tls_ ? tls_->next_layer() : *tcp_; }
  executor_type get_executor() { return tcp().get_executor(); }

  /// Greets a client of TLS, which has to be there.
  template <class Handler>
  void async_handshake(Handler&& handler) {
    tls_->async_handshake(boost::asio::ssl::stream_base::server,
                          AnyHandler<Error>(std::forward<Handler>(handler)));
  }

  template <class Buffers, class Handler>
  void async_read_some(const Buffers& buffers, Handler&& handler) {
    read(gather<boost::asio::mutable_buffer>(buffers),
         AnyHandler<Error, std::size_t>(std::forward<Handler>(handler)));
  }

  template <class Buffers, class Handler>
  void async_write_some(const Buffers& buffers, Handler&& handler) {
    write(gather<boost::asio::const_buffer>(buffers),
          AnyHandler<Error, std::size_t>(std::forward<Handler>(handler)));
  }

  /// Beast's customization points: the end of a WebSocket, and of one that takes too long.
  template <class Handler>
  friend void async_teardown(boost::beast::role_type role, WebStream& stream, Handler&& handler) {
    stream.end(role, AnyHandler<Error>(std::forward<Handler>(handler)));
  }
  friend void beast_close_socket(WebStream& stream) { stream.tcp().close(); }

 private:
  template <class Buffer>
  using Gathered = std::array<Buffer, 8>;

  /// The first of the buffers; "some" of the bytes is all that has been asked for.
  template <class Buffer, class Buffers>
  static Gathered<Buffer> gather(const Buffers& buffers) {
    Gathered<Buffer> result;
    std::size_t count = 0;
    auto next = boost::asio::buffer_sequence_begin(buffers);
    const auto end = boost::asio::buffer_sequence_end(buffers);
    for (; next != end && count < result.size(); ++next) {
      const Buffer buffer(*next);
      if (buffer.size() > 0) result[count++] = buffer;
    }
    return result;
  }

  void read(const Gathered<boost::asio::mutable_buffer>& buffers,
            AnyHandler<Error, std::size_t> handler) {
    if (tls_) return tls_->async_read_some(buffers, std::move(handler));
    tcp_->async_read_some(buffers, std::move(handler));
  }

  void write(const Gathered<boost::asio::const_buffer>& buffers,
             AnyHandler<Error, std::size_t> handler) {
    if (tls_) return tls_->async_write_some(buffers, std::move(handler));
    tcp_->async_write_some(buffers, std::move(handler));
  }

  void end(boost::beast::role_type role, AnyHandler<Error> handler) {
    using boost::beast::async_teardown;
    using boost::beast::websocket::async_teardown;
    if (tls_) return async_teardown(role, *tls_, std::move(handler));
    async_teardown(role, *tcp_, std::move(handler));
  }

  std::unique_ptr<Tcp> tcp_;  ///< One of the two.
  std::unique_ptr<Tls> tls_;
};

}  // namespace sovo::bridge
