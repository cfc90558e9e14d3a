#pragma once

#include <arpa/inet.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstring>
#include <string>

namespace sovo {

/// Puts this thread, and those that it starts, into a network of its own that has only the loopback
/// interface, with the addresses 127.0.0.1 to 127.0.0.4. False where the system does not allow it.
inline bool enter_private_network() {
  if (::unshare(CLONE_NEWNET) != 0 && ::unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) return false;
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  bool done = fd >= 0;
  for (int i = 0; i < 4 && done; ++i) {
    ifreq request{};
    const std::string name = i == 0 ? "lo" : "lo:" + std::to_string(i);
    std::strncpy(request.ifr_name, name.c_str(), IFNAMSIZ - 1);
    if (i > 0) {
      sockaddr_in own{};
      own.sin_family = AF_INET;
      own.sin_addr.s_addr = htonl(INADDR_LOOPBACK + static_cast<unsigned>(i));
      std::memcpy(&request.ifr_addr, &own, sizeof own);
      done = ::ioctl(fd, SIOCSIFADDR, &request) == 0;
    }
    request.ifr_flags = IFF_UP | IFF_LOOPBACK | IFF_RUNNING;
    done = done && ::ioctl(fd, SIOCSIFFLAGS, &request) == 0;
  }
  if (fd >= 0) ::close(fd);
  return done;
}

}  // namespace sovo
