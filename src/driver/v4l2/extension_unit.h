#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "sovo/driver/v4l2/v4l2_file.h"
#include "sovo/io/result.h"

namespace sovo::v4l2 {

/// One control of a UVC camera's vendor extension: messages go to the camera, and their answers
/// come from there.
class ExtensionUnit {
 public:
  virtual ~ExtensionUnit() = default;
  /// Size of all messages [bytes]. The error says that the camera has no such unit.
  virtual Result<std::size_t> message_size() = 0;
  virtual Result<void> send(std::span<std::uint8_t> message) = 0;
  virtual Result<void> receive(std::span<std::uint8_t> message) = 0;
};

/// The unit as the kernel's driver gives it (UVCIOC_CTRL_QUERY).
class UvcExtensionUnit : public ExtensionUnit {
 public:
  UvcExtensionUnit(const DeviceFile& file, std::uint8_t unit, std::uint8_t selector)
      : file_(file), unit_(unit), selector_(selector) {}

  Result<std::size_t> message_size() override;
  Result<void> send(std::span<std::uint8_t> message) override;
  Result<void> receive(std::span<std::uint8_t> message) override;

 private:
  Result<void> query(std::uint8_t what, std::span<std::uint8_t> data) const;

  const DeviceFile& file_;
  std::uint8_t unit_;
  std::uint8_t selector_;
};

}  // namespace sovo::v4l2
