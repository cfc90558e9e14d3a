#include "sovo/bridge/shared_memory.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <string>

namespace sovo::bridge {
namespace {

TEST(SharedMemory, RouDiIsThereOnlyWhileItListens) {
  const std::string path = "/tmp/roudi_test" + std::to_string(::getpid());
  EXPECT_FALSE(is_roudi_running(path));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  const int handle = ::socket(AF_UNIX, SOCK_DGRAM, 0);
  ASSERT_EQ(::bind(handle, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  EXPECT_TRUE(is_roudi_running(path));
  ::close(handle);
  EXPECT_FALSE(is_roudi_running(path)) << "its file is left, nobody listens";
  ::unlink(path.c_str());
}

TEST(SharedMemory, OnlyCameraAndOdometryUseIt) {
  DdsConfig config;
  NetworkPlan plan;
  ASSERT_TRUE(plan_shared_memory(config, "vo", &plan).ok());
  EXPECT_EQ(plan.xml.find("SharedMemory"), std::string::npos);
  config.transport = Transport::kShm;
  for (const char* node : {"record", "replay", "dashboard", "status"}) {
    NetworkPlan other;
    ASSERT_TRUE(plan_shared_memory(config, node, &other).ok());
    EXPECT_NE(other.xml.find("<Enable>false</Enable>"), std::string::npos) << node;
  }
  config.security = "keys";
  EXPECT_FALSE(plan_shared_memory(config, "vo", &plan).ok());
}

}  // namespace
}  // namespace sovo::bridge
