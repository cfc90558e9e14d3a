#pragma once

#include <netinet/in.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sovo/io/result.h"

namespace sovo::aravis {

/// Which cameras an action command is for, as set in their ActionDeviceKey, ActionGroupKey and
/// ActionGroupMask.
struct ActionKeys {
  std::uint32_t device = 0;
  std::uint32_t group = 0;
  std::uint32_t mask = 0;
};

/// An ACTION_CMD of GigE Vision 2: 28 bytes, big endian. `time_ns`: when it shall be done, by the
/// PTP clock; the camera is asked to acknowledge.
std::array<std::uint8_t, 28> action_command(std::uint16_t id, const ActionKeys& keys,
                                            std::uint64_t time_ns);

/// A READREG_CMD of one register.
std::array<std::uint8_t, 12> read_register_command(std::uint16_t id, std::uint32_t address);

/// The head of an answer.
struct GvcpAck {
  std::uint16_t status = 0;
  std::uint16_t command = 0;
  std::uint16_t id = 0;
};
/// Nothing for what is no answer.
std::optional<GvcpAck> read_ack(std::span<const std::uint8_t> packet);

/// What became of the action commands of a camera.
struct ActionCounts {
  std::uint64_t sent = 0;
  std::uint64_t accepted = 0;
  std::uint64_t late = 0;     ///< The camera got it after its time.
  std::uint64_t no_time = 0;  ///< The camera's clock is not set by PTP.
  std::uint64_t refused = 0;  ///< For other reasons.
};

/// Sends to a camera what libaravis has no call for. For one thread.
class GvcpSocket {
 public:
  static Result<GvcpSocket> open(const sockaddr_in& camera);
  ~GvcpSocket();
  GvcpSocket(GvcpSocket&& other) noexcept;
  GvcpSocket& operator=(GvcpSocket&&) = delete;

  /// Whether the camera answers; asks twice.
  bool answers(std::chrono::milliseconds timeout);

  /// Sends an action command, and looks at the answers to those before.
  void send_action(const ActionKeys& keys, std::uint64_t time_ns);
  const ActionCounts& counts() const { return counts_; }

 private:
  explicit GvcpSocket(int fd) : fd_(fd) {}

  /// The next answer, when one comes in time.
  std::optional<GvcpAck> receive(std::chrono::milliseconds timeout);
  void count(const GvcpAck& ack);

  int fd_;
  std::uint16_t next_id_ = 1;
  ActionCounts counts_;
};

}  // namespace sovo::aravis
