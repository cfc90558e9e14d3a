#include "sovo/driver/v4l2/v4l2_file.h"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace sovo::v4l2 {

std::string errno_text() { return std::generic_category().message(errno); }

Result<DeviceFile> DeviceFile::open(const std::string& path) {
  const int fd = ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (fd >= 0) return DeviceFile(fd);
  if (errno == EACCES) {
    return Error{path + ": permission denied; add yourself to the group video: sudo usermod -aG " +
                 "video $USER, then log in again"};
  }
  if (errno == ENOENT) return Error{path + ": there is no such device; is the camera plugged in?"};
  return Error{path + ": cannot be opened: " + errno_text()};
}

DeviceFile::~DeviceFile() {
  if (fd_ >= 0) ::close(fd_);
}

int DeviceFile::control(unsigned long request, void* argument) const {
  int result = 0;
  do {
    result = ::ioctl(fd_, request, argument);
  } while (result == -1 && errno == EINTR);
  return result;
}

}  // namespace sovo::v4l2
