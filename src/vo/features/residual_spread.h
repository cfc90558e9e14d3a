#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace sovo {

/// Standard deviation of both coordinates of two-dimensional residuals, by the median of their
/// lengths, which outliers hardly change. 0 of none.
inline double residual_spread(std::vector<double> lengths) {
  if (lengths.empty()) return 0.0;
  constexpr double kMedianOfTwo = 1.1774;  // of the length of two normal numbers
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return *middle / kMedianOfTwo;
}

/// What of a spread, in units of the one expected, is believed where it tells outliers.
inline double spread_for_outliers(double spread) { return std::clamp(spread, 1.0, 3.0); }

/// And where it tells how far estimates are to be trusted.
inline double spread_for_covariance(double spread) { return std::clamp(spread, 0.3, 3.0); }

}  // namespace sovo
