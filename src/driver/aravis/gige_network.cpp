#include "sovo/driver/aravis/gige_network.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>

#include <algorithm>
#include <cstring>

#include "sovo/driver/aravis/glib_owner.h"
#include "sovo/io/text.h"

namespace sovo::aravis {
namespace {

constexpr int kLargestPacket = 8192;  // more saves nothing, and some cameras have no more
constexpr int kSmallestPacket = 576;  // what IPv4 carries everywhere

std::uint32_t ipv4(const sockaddr* address) {
  if (address == nullptr || address->sa_family != AF_INET) return 0;
  sockaddr_in in{};
  std::memcpy(&in, address, sizeof in);
  return ntohl(in.sin_addr.s_addr);
}

int number_of_interface(const std::string& name, const char* what, int otherwise) {
  const auto text = read_text_file("/sys/class/net/" + name + "/" + what);
  const auto value = text ? parse_integer(trim(*text)) : std::nullopt;
  return value && *value > 0 && *value < 1'000'000 ? static_cast<int>(*value) : otherwise;
}

}  // namespace

InterfaceInfo find_interface(const std::string& address) {
  in_addr wanted{};
  ifaddrs* list = nullptr;
  if (::inet_pton(AF_INET, address.c_str(), &wanted) != 1 || ::getifaddrs(&list) != 0) return {};
  const std::uint32_t host = ntohl(wanted.s_addr);
  InterfaceInfo info;
  std::uint32_t narrowest = 0;
  for (const ifaddrs* at = list; at != nullptr; at = at->ifa_next) {
    const std::uint32_t own = ipv4(at->ifa_addr);
    if (own == 0) continue;
    const std::uint32_t mask = own == host ? 0xffffffffU : ipv4(at->ifa_netmask);
    if ((own & mask) != (host & mask) || mask < narrowest || mask == 0) continue;
    narrowest = mask;
    info.name = at->ifa_name;
  }
  ::freeifaddrs(list);
  // An alias ("lo:1") is its interface.
  info.name = info.name.substr(0, info.name.find(':'));
  if (info.name.empty()) return info;
  info.mtu = number_of_interface(info.name, "mtu", info.mtu);
  info.speed_mbps = number_of_interface(info.name, "speed", 0);
  return info;
}

int fit_packet_size(int wanted, int mtu) {
  const int size = std::min(wanted > 0 ? wanted : kLargestPacket, mtu);
  return std::max(kSmallestPacket, size) / 4 * 4;
}

int port_share(int speed_mbps) { return speed_mbps * 45 / 100; }

Result<GigeInfo> find_camera(const std::vector<GigeInfo>& cameras, const std::string& wish) {
  std::string known;
  for (const GigeInfo& camera : cameras) {
    if (wish == camera.serial || wish == camera.address || wish == camera.id) {
      return camera;
    }
    known += (known.empty() ? "" : ", ") + camera.serial + " at " + camera.address;
  }
  return Error{"no GigE Vision camera is '" + excerpt(wish) + "'; " +
               (known.empty() ? "none answers: is it in the subnet of this machine's port, and UDP "
                                "port 3956 open?"
                              : "there are: " + known)};
}

GigeNetwork::GigeNetwork() {
  // Looking there would cost time, and finds what this driver is not for.
  arv_disable_interface("USB3Vision");
  arv_disable_interface("Fake");
}

std::vector<GigeInfo> GigeNetwork::cameras() {
  const std::scoped_lock lock(mutex_);
  arv_update_device_list();
  std::vector<GigeInfo> cameras;
  for (unsigned i = 0; i < arv_get_n_devices(); ++i) {
    GigeInfo info;
    info.id = to_text(arv_get_device_id(i));
    info.name = to_text(arv_get_device_vendor(i)) + " " + to_text(arv_get_device_model(i));
    info.serial = to_text(arv_get_device_serial_nbr(i));
    info.address = to_text(arv_get_device_address(i));
    info.interface = find_interface(info.address).name;
    cameras.push_back(std::move(info));
  }
  return cameras;
}

}  // namespace sovo::aravis
