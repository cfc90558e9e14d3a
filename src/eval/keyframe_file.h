#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "sovo/io/result.h"

namespace sovo {

/// One line of a `--keyframes` file: a scale optimization.
struct KeyframeRecord {
  std::int64_t stamp_ns = 0;
  double correction = 0.0;  ///< Measured log-scale error.
  double sigma = 0.0;       ///< Its standard deviation.
  std::string verdict;
};

/// Reads `stamp,correction,sigma,verdict` (a header line names the columns, in any order; stamps
/// in decimal seconds, or whole nanoseconds). The error names file, line and field.
Result<std::vector<KeyframeRecord>> read_keyframes(const std::string& path);

}  // namespace sovo
