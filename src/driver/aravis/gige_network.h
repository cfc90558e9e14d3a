#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "sovo/io/result.h"

namespace sovo::aravis {

/// A camera on the network.
struct GigeInfo {
  std::string id;    ///< What libaravis opens it by.
  std::string name;  ///< Vendor and model.
  std::string serial;
  std::string address;    ///< IPv4.
  std::string interface;  ///< Network interface of this machine that reaches it; may be empty.
};

/// A network interface of this machine.
struct InterfaceInfo {
  std::string name;
  int mtu = 1500;      ///< Largest packet [bytes].
  int speed_mbps = 0;  ///< [Mbit/s]; 0 when it does not tell.
};

/// The interface with this own address (dotted IPv4), or whose subnet has it; nothing known of it
/// when there is none.
InterfaceInfo find_interface(const std::string& address);

/// Packet size that fits an interface: `wanted` bytes, or as much as is useful when that is 0, at
/// most the MTU, a multiple of 4.
int fit_packet_size(int wanted, int mtu);

/// Share of a port [Mbit/s] that one of two cameras on it may take, with room for resent packets.
int port_share(int speed_mbps);

/// The one of `cameras` that `wish` means: serial number, address or libaravis' id. The
/// error lists what there is.
Result<GigeInfo> find_camera(const std::vector<GigeInfo>& cameras, const std::string& wish);

/// Looks for GigE Vision cameras. libaravis keeps one list a process, so that those who look or
/// open cameras share one of these; it may be used by several threads.
class GigeNetwork {
 public:
  GigeNetwork();

  /// All cameras that answer within a second.
  std::vector<GigeInfo> cameras();

  /// The right to open and set up a camera: libaravis reads one description of features at a time.
  std::unique_lock<std::mutex> alone() { return std::unique_lock(mutex_); }

 private:
  std::mutex mutex_;
};

}  // namespace sovo::aravis
