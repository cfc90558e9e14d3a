#pragma once

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstddef>
#include <cstring>
#include <stdexcept>
#include <string>

namespace sovo::bridge {

/// A DDS domain, 1 to 100, that no other test process on this network has while this object lives.
///
/// It is held by a name in the abstract space of Unix sockets: that space is the network
/// namespace's, as the domain is, and the kernel frees the name however the process ends. The tests
/// of the command hold theirs by the same names (tests/app/harness.py).
class OwnDomain {
 public:
  OwnDomain() {
    // Each process begins elsewhere, so that a domain rests before somebody takes it again.
    const int first = static_cast<int>(::getpid() % kCount);
    for (int i = 0; i < kCount; ++i) {
      number_ = 1 + (first + i) % kCount;
      if (take()) return;
    }
    throw std::runtime_error("all DDS domains for tests are taken");
  }
  ~OwnDomain() { ::close(socket_); }
  OwnDomain(const OwnDomain&) = delete;
  OwnDomain& operator=(const OwnDomain&) = delete;

  int number() const { return number_; }

 private:
  static constexpr int kCount = 100;

  bool take() {
    socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (socket_ < 0) throw std::runtime_error("no Unix socket can be opened");
    const std::string name = "sovo_test_domain_" + std::to_string(number_);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path + 1, name.data(), name.size());
    const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
    if (::bind(socket_, reinterpret_cast<const sockaddr*>(&address), size) == 0) return true;
    ::close(socket_);
    return false;
  }

  int number_ = 0;
  int socket_ = -1;
};

}  // namespace sovo::bridge
