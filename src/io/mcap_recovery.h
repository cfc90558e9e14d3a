#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sovo/io/result.h"

namespace sovo {

/// What mending a file came to.
struct McapRecovery {
  bool was_whole = false;  ///< Nothing had to be done.
  std::uint64_t messages = 0;
  std::vector<std::string> notes;  ///< What was wrong.
};

/// Writes what can be read of a cut or damaged MCAP file, with a new index, in its place; the
/// damaged file stays beside it as PATH.cut. Needs as much room on the disk again.
Result<McapRecovery> recover_mcap(const std::string& path);

}  // namespace sovo
