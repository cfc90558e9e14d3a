#pragma once

#include <spdlog/spdlog.h>

#include <string>

#include "sovo/app/exit_codes.h"

namespace sovo::app {

/// Logs why the command ends, and gives its exit code.
inline int fail(ExitCode code, const std::string& message) {
  spdlog::error("{}", message);
  return code;
}

}  // namespace sovo::app
