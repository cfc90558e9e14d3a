#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace sovo {

/// The value that a share of some values remain below. Precondition: there are some.
inline float lower_share(std::vector<float> values, double share) {
  const auto n = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size()));
  const auto at = values.begin() + std::min(n, std::ssize(values) - 1);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace sovo
