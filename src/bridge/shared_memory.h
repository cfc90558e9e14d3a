#pragma once

#include <string>

#include "sovo/bridge/dds_config.h"
#include "sovo/io/result.h"

namespace sovo::bridge {

/// Adds to `plan` how the process `node` uses shared memory. It is on for `camera` and `vo` alone,
/// and only with `transport: shm`; the others pass messages on as bytes, which Cyclone DDS cannot
/// do with it. An error when RouDi, its daemon, does not run (Cyclone DDS would wait for it and
/// then abort) and beside DDS Security, which it would go around.
Result<void> plan_shared_memory(const DdsConfig& config, const std::string& node,
                                NetworkPlan* plan);

/// Whether RouDi listens at `socket_path`; does not wait.
bool is_roudi_running(const std::string& socket_path = "/tmp/roudi");

}  // namespace sovo::bridge
