#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace sovo {

/// The upper median; 0 of none. Reorders the values.
template <class T>
T median(std::vector<T>* values) {
  if (values->empty()) return T(0);
  const auto middle = values->begin() + static_cast<std::ptrdiff_t>(values->size() / 2);
  std::nth_element(values->begin(), middle, values->end());
  return *middle;
}

/// The same of values that stay in their order; `scratch` is memory to sort them in.
template <class T>
T median(const std::vector<T>& values, std::vector<T>* scratch) {
  *scratch = values;
  return median(scratch);
}

}  // namespace sovo
