#include "sovo/driver/aravis/gvcp.h"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstring>
#include <utility>

namespace sovo::aravis {
namespace {

constexpr std::uint8_t kKey = 0x42;          // of every command
constexpr std::uint8_t kAckRequired = 0x01;  // flags
constexpr std::uint8_t kScheduled = 0x80;
constexpr std::uint16_t kReadRegister = 0x0080;
constexpr std::uint16_t kAction = 0x0100;
constexpr std::uint16_t kActionAck = 0x0101;
constexpr std::uint16_t kNoReferenceTime = 0x8013;
constexpr std::uint16_t kActionLate = 0x8016;
constexpr std::uint32_t kControlPrivilege = 0x0a00;  // a register that every camera has
constexpr std::size_t kHeader = 8;

/// Writes numbers in network order, one after the other.
class PacketWriter {
 public:
  explicit PacketWriter(std::uint8_t* at) : at_(at) {}

  template <class T>
  PacketWriter& put(T value) {
    for (int shift = 8 * static_cast<int>(sizeof(T)) - 8; shift >= 0; shift -= 8) {
      *at_++ = static_cast<std::uint8_t>(value >> shift);
    }
    return *this;
  }

 private:
  std::uint8_t* at_;
};

}  // namespace

std::array<std::uint8_t, 28> action_command(std::uint16_t id, const ActionKeys& keys,
                                            std::uint64_t time_ns) {
  std::array<std::uint8_t, 28> packet{};
  PacketWriter(packet.data())
      .put(kKey)
      .put(static_cast<std::uint8_t>(kScheduled | kAckRequired))
      .put(kAction)
      .put(static_cast<std::uint16_t>(packet.size() - kHeader))
      .put(id)
      .put(keys.device)
      .put(keys.group)
      .put(keys.mask)
      .put(time_ns);
  return packet;
}

std::array<std::uint8_t, 12> read_register_command(std::uint16_t id, std::uint32_t address) {
  std::array<std::uint8_t, 12> packet{};
  PacketWriter(packet.data())
      .put(kKey)
      .put(kAckRequired)
      .put(kReadRegister)
      .put(static_cast<std::uint16_t>(packet.size() - kHeader))
      .put(id)
      .put(address);
  return packet;
}

std::optional<GvcpAck> read_ack(std::span<const std::uint8_t> packet) {
  if (packet.size() < kHeader) return std::nullopt;
  const auto word = [&packet](std::size_t at) {
    return static_cast<std::uint16_t>(packet[at] << 8U | packet[at + 1]);
  };
  const GvcpAck ack{word(0), word(2), word(6)};
  // Commands are even, their answers odd.
  if (ack.command % 2 == 0 || word(4) + kHeader > packet.size()) return std::nullopt;
  return ack;
}

Result<GvcpSocket> GvcpSocket::open(const sockaddr_in& camera) {
  GvcpSocket result(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  sockaddr address{};
  static_assert(sizeof address == sizeof camera);
  std::memcpy(&address, &camera, sizeof camera);
  if (result.fd_ < 0 || ::connect(result.fd_, &address, sizeof address) != 0) {
    return Error{std::string("no socket to the camera: ") + std::strerror(errno)};
  }
  return result;
}

GvcpSocket::GvcpSocket(GvcpSocket&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)), next_id_(other.next_id_), counts_(other.counts_) {}

GvcpSocket::~GvcpSocket() {
  if (fd_ >= 0) ::close(fd_);
}

std::optional<GvcpAck> GvcpSocket::receive(std::chrono::milliseconds timeout) {
  pollfd poll{fd_, POLLIN, 0};
  if (::poll(&poll, 1, static_cast<int>(timeout.count())) <= 0) return std::nullopt;
  std::array<std::uint8_t, 576> packet{};
  const auto size = ::recv(fd_, packet.data(), packet.size(), MSG_DONTWAIT);
  if (size < 0) return std::nullopt;
  return read_ack({packet.data(), static_cast<std::size_t>(size)});
}

bool GvcpSocket::answers(std::chrono::milliseconds timeout) {
  for (int i = 0; i < 2; ++i) {
    const auto command = read_register_command(next_id_, kControlPrivilege);
    next_id_ = static_cast<std::uint16_t>(next_id_ == 0xffff ? 1 : next_id_ + 1);
    (void)::send(fd_, command.data(), command.size(), MSG_NOSIGNAL);
    while (const auto ack = receive(timeout)) {
      if (ack->command != kActionAck) return true;
      count(*ack);
    }
  }
  return false;
}

void GvcpSocket::send_action(const ActionKeys& keys, std::uint64_t time_ns) {
  while (const auto ack = receive(std::chrono::milliseconds(0))) count(*ack);
  const auto command = action_command(next_id_, keys, time_ns);
  next_id_ = static_cast<std::uint16_t>(next_id_ == 0xffff ? 1 : next_id_ + 1);
  ++counts_.sent;
  (void)::send(fd_, command.data(), command.size(), MSG_NOSIGNAL);
}

void GvcpSocket::count(const GvcpAck& ack) {
  if (ack.command != kActionAck) return;
  if (ack.status == 0) {
    ++counts_.accepted;
  } else if (ack.status == kActionLate) {
    ++counts_.late;
  } else if (ack.status == kNoReferenceTime) {
    ++counts_.no_time;
  } else {
    ++counts_.refused;
  }
}

}  // namespace sovo::aravis
