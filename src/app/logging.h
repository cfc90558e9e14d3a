#pragma once

#include <string>
#include <vector>

namespace sovo::app {

/// Names that `--log-level` takes.
std::vector<std::string> log_levels();

/// Sends the log to stderr, so that stdout carries results alone.
void set_up_logging(const std::string& level);

}  // namespace sovo::app
