#include "sovo/eval/statistics.h"

#include <algorithm>
#include <cmath>

namespace sovo {

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  const double position = std::clamp(q, 0.0, 1.0) * static_cast<double>(values.size() - 1);
  const std::size_t below = static_cast<std::size_t>(position);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  const double fraction = position - static_cast<double>(below);
  return values[below] + fraction * (values[above] - values[below]);
}

Statistics statistics_of(std::span<const double> errors) {
  Statistics s;
  s.count = static_cast<int>(errors.size());
  if (errors.empty()) return s;
  for (const double e : errors) {
    s.mean += e;
    s.rmse += e * e;
  }
  s.mean /= static_cast<double>(errors.size());
  s.rmse = std::sqrt(s.rmse / static_cast<double>(errors.size()));
  const std::vector<double> values(errors.begin(), errors.end());
  s.median = quantile(values, 0.5);
  s.p95 = quantile(values, 0.95);
  s.max = *std::max_element(errors.begin(), errors.end());
  return s;
}

}  // namespace sovo
