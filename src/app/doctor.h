#pragma once

#include <string>
#include <vector>

namespace sovo::app {

/// One thing that was looked at.
struct Finding {
  bool good = true;
  std::string text;  ///< What was found.
  std::string mend;  ///< A line for the shell that mends it; empty when it is good.
};

/// Looks at the settings of a machine that cameras and large messages depend on. `root`: where
/// /proc, /sys and /dev are found.
std::vector<Finding> examine_machine(const std::string& root = "/");

}  // namespace sovo::app
