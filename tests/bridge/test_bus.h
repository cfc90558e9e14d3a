#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <string>
#include <thread>

#include "own_domain.h"
#include "sovo/bridge/participant.h"

namespace sovo::bridge {

/// A domain of this process's own, so that tests may run beside each other.
inline int test_domain() {
  static const OwnDomain domain;
  return domain.number();
}

/// A participant on loopback, whatever the environment says.
inline Participant open_participant(DdsConfig config = {}) {
  if (config.domain < 0) config.domain = test_domain();
  auto participant = Participant::open(config, "test", DdsEnvironment{});
  if (!participant) throw std::runtime_error(participant.error());
  return std::move(*participant);
}

/// A participant of this process that shares nothing with those of open_participant but the
/// network: samples between them go through sockets.
inline Participant open_remote_participant(DdsConfig config = {}) {
  config.domain = test_domain() + 100;
  DdsEnvironment environment;
  environment.cyclonedds_uri =
      "<CycloneDDS><Domain Id=\"any\"><General><Interfaces><NetworkInterface name=\"lo\" "
      "multicast=\"true\"/></Interfaces></General><Discovery><ExternalDomainId>" +
      std::to_string(test_domain()) + "</ExternalDomainId></Discovery></Domain></CycloneDDS>";
  auto participant = Participant::open(config, "remote", environment);
  if (!participant) throw std::runtime_error(participant.error());
  return std::move(*participant);
}

/// The value, or a failed test with the error text.
template <class T>
T require(Result<T> result) {
  if (!result) throw std::runtime_error(result.error());
  return std::move(*result);
}

/// Waits for what discovery and threads will bring about.
inline bool eventually(const std::function<bool()>& condition) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

}  // namespace sovo::bridge
