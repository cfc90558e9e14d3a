#pragma once

#include <arpa/inet.h>

#include <array>
#include <cstdint>

namespace sovo::test {

// The protocol between the kernel's vhci_hcd and a device that is emulated in a process (USB/IP,
// Documentation/usb/usbip_protocol.rst). All numbers are big endian.

inline constexpr std::uint32_t kSubmit = 1;
inline constexpr std::uint32_t kUnlink = 2;
inline constexpr std::uint32_t kReturnSubmit = 3;
inline constexpr std::uint32_t kReturnUnlink = 4;

/// A header of 48 bytes: twelve words, or ten and a set-up packet.
struct UsbipHeader {
  std::array<std::uint32_t, 10> words{};
  std::array<std::uint8_t, 8> setup{};

  std::uint32_t word(std::size_t i) const { return ntohl(words[i]); }
  void set(std::size_t i, std::uint32_t value) { words[i] = htonl(value); }

  std::uint32_t command() const { return word(0); }
  std::uint32_t sequence() const { return word(1); }
  bool to_host() const { return word(3) != 0; }
  std::uint32_t endpoint() const { return word(4); }
  std::uint32_t length() const { return word(6); }    ///< Of a submission.
  std::uint32_t unlinked() const { return word(5); }  ///< Sequence that shall be given up.
};
static_assert(sizeof(UsbipHeader) == 48);

/// A control request of USB.
struct ControlRequest {
  std::uint8_t type;
  std::uint8_t request;
  std::uint16_t value;
  std::uint16_t index;
  std::uint16_t length;

  explicit ControlRequest(const std::array<std::uint8_t, 8>& b)
      : type(b[0]),
        request(b[1]),
        value(static_cast<std::uint16_t>(b[2] | b[3] << 8)),
        index(static_cast<std::uint16_t>(b[4] | b[5] << 8)),
        length(static_cast<std::uint16_t>(b[6] | b[7] << 8)) {}
};

}  // namespace sovo::test
