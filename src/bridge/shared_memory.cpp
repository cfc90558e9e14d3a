#include "sovo/bridge/shared_memory.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>

namespace sovo::bridge {
namespace {

std::string shared_memory_xml(bool enable) {
  return std::string(",<CycloneDDS><Domain Id=\"any\"><SharedMemory><Enable>") +
         (enable ? "true" : "false") + "</Enable></SharedMemory></Domain></CycloneDDS>";
}

}  // namespace

bool is_roudi_running(const std::string& socket_path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (socket_path.size() >= sizeof(address.sun_path)) return false;
  std::memcpy(address.sun_path, socket_path.c_str(), socket_path.size() + 1);
  const int handle = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (handle < 0) return false;
  // A socket file that a dead RouDi left behind refuses.
  const bool there =
      ::connect(handle, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
  ::close(handle);
  return there;
}

Result<void> plan_shared_memory(const DdsConfig& config, const std::string& node,
                                NetworkPlan* plan) {
  const bool may = node == "camera" || node == "vo";
  const bool wanted = config.transport == Transport::kShm;
  if (wanted && !config.security.empty()) {
    return Error{
        "dds.transport: shm and dds.security exclude each other: what lies in shared memory is not "
        "encrypted"};
  }
  if (!may) {
    plan->xml += shared_memory_xml(false);
    return {};
  }
  if (!wanted) return {};
  if (!is_roudi_running()) {
    return Error{
        "dds.transport is shm and RouDi does not run: start iox-roudi (Debian's package iceoryx), "
        "or set dds.transport to udp"};
  }
  plan->xml += shared_memory_xml(true);
  plan->notes.push_back("images between camera and vo go through shared memory (iceoryx)");
  return {};
}

}  // namespace sovo::bridge
