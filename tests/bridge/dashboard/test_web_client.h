#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <cstdint>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace sovo::bridge {

/// A bare socket that speaks HTTP and WebSocket by hand, so that it can speak them wrongly too.
class TestWebClient {
 public:
  explicit TestWebClient(std::uint16_t port, int receive_buffer = 0) : port_(port) {
    fd_ = socket(AF_INET, SOCK_STREAM, 0);
    if (receive_buffer > 0) {
      setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof(receive_buffer));
    }
    const timeval patience{20, 0};
    setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof(address)) != 0) {
      throw std::runtime_error("cannot connect");
    }
  }
  ~TestWebClient() { close(fd_); }
  TestWebClient(const TestWebClient&) = delete;
  TestWebClient& operator=(const TestWebClient&) = delete;

  void send_raw(const std::string& bytes) {
    (void)!::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  }

  /// Head and body of the answer to a GET; `headers`: whole lines with their \r\n.
  std::string get(const std::string& target, const std::string& headers = "") {
    send_raw("GET " + target + " HTTP/1.1\r\n" + host_unless_in(headers) + headers +
             "Connection: close\r\n\r\n");
    while (fill()) {
    }
    return std::exchange(buffer_, {});
  }

  /// Becomes a WebSocket; the status line.
  std::string upgrade(const std::string& headers = "",
                      const std::string& subprotocol = "foxglove.websocket.v1",
                      const std::string& target = "/") {
    send_raw("GET " + target + " HTTP/1.1\r\n" + host_unless_in(headers) + headers +
             "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
             "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n" +
             (subprotocol.empty() ? "" : "Sec-WebSocket-Protocol: " + subprotocol + "\r\n") +
             "\r\n");
    std::size_t end = 0;
    while ((end = buffer_.find("\r\n\r\n")) == std::string::npos) {
      if (!fill()) return buffer_;
    }
    head_ = buffer_.substr(0, end);
    buffer_.erase(0, end + 4);
    return head_.substr(0, head_.find("\r\n"));
  }
  const std::string& head() const { return head_; }

  /// A masked frame, as clients send them.
  void send_frame(int opcode, const std::string& payload) {
    std::string frame(1, static_cast<char>(0x80 | opcode));
    if (payload.size() < 126) {
      frame += static_cast<char>(0x80 | payload.size());
    } else if (payload.size() < 65536) {
      frame += static_cast<char>(0x80 | 126);
      for (int shift : {8, 0}) frame += static_cast<char>(payload.size() >> shift & 0xFF);
    } else {
      frame += static_cast<char>(0x80 | 127);
      for (int shift = 56; shift >= 0; shift -= 8) {
        frame += static_cast<char>(payload.size() >> shift & 0xFF);
      }
    }
    const char mask[4] = {1, 2, 3, 4};
    frame.append(mask, 4);
    for (std::size_t i = 0; i < payload.size(); ++i) {
      frame += static_cast<char>(payload[i] ^ mask[i % 4]);
    }
    send_raw(frame);
  }
  void send_text(const std::string& text) { send_frame(1, text); }

  struct Frame {
    int opcode = 0;
    std::string payload;
  };
  /// The next frame; nothing when the server closed the connection.
  std::optional<Frame> receive() {
    constexpr int kClose = 8;
    while (true) {
      if (auto frame = parse_frame()) {
        if (frame->opcode == kClose) return std::nullopt;
        return frame;
      }
      if (!fill()) return std::nullopt;
    }
  }
  /// The next text message that contains `part`, past all others; empty when there is none.
  std::string receive_text_with(const std::string& part) {
    while (auto frame = receive()) {
      if (frame->opcode == 1 && frame->payload.find(part) != std::string::npos) {
        return frame->payload;
      }
    }
    return "";
  }
  /// The next binary message.
  std::string receive_binary() {
    while (auto frame = receive()) {
      if (frame->opcode == 2) return frame->payload;
    }
    return "";
  }

 private:
  std::string host_unless_in(const std::string& headers) const {
    if (headers.find("Host:") != std::string::npos) return "";
    return "Host: localhost:" + std::to_string(port_) + "\r\n";
  }

  bool fill() {
    char bytes[65536];
    const ssize_t count = recv(fd_, bytes, sizeof(bytes), 0);
    if (count <= 0) return false;
    buffer_.append(bytes, static_cast<std::size_t>(count));
    return true;
  }

  std::optional<Frame> parse_frame() {
    if (buffer_.size() < 2) return std::nullopt;
    std::size_t length = static_cast<unsigned char>(buffer_[1]) & 0x7FU;
    std::size_t head = 2;
    if (length >= 126) {
      const std::size_t bytes = length == 126 ? 2 : 8;
      if (buffer_.size() < head + bytes) return std::nullopt;
      length = 0;
      for (std::size_t i = 0; i < bytes; ++i) {
        length = length << 8U | static_cast<unsigned char>(buffer_[head + i]);
      }
      head += bytes;
    }
    if (buffer_.size() < head + length) return std::nullopt;
    Frame frame{buffer_[0] & 0x0F, buffer_.substr(head, length)};
    buffer_.erase(0, head + length);
    return frame;
  }

  std::uint16_t port_;
  int fd_ = -1;
  std::string buffer_;
  std::string head_;
};

}  // namespace sovo::bridge
