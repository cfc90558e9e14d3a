#pragma once

#include <string>
#include <utility>

#include "sovo/io/result.h"

namespace sovo::v4l2 {

/// An open device file; closed with the object.
class DeviceFile {
 public:
  /// Opens without waiting in later reads. The error says which group or rule is missing.
  static Result<DeviceFile> open(const std::string& path);

  DeviceFile(DeviceFile&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  DeviceFile& operator=(DeviceFile&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~DeviceFile();

  int fd() const { return fd_; }
  /// ioctl that is tried again when a signal interrupts it; 0, or -1 with `errno`.
  int control(unsigned long request, void* argument) const;

 private:
  explicit DeviceFile(int fd) : fd_(fd) {}

  int fd_ = -1;
};

/// Text of `errno`.
std::string errno_text();

}  // namespace sovo::v4l2
