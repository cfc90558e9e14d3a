#include "sovo/eval/association.h"

#include <algorithm>
#include <cstdlib>

namespace sovo {
namespace {

std::size_t nearest_index(std::span<const std::int64_t> stamps, std::int64_t stamp) {
  const auto after = std::lower_bound(stamps.begin(), stamps.end(), stamp);
  if (after == stamps.begin()) return 0;
  const std::size_t index = static_cast<std::size_t>(after - stamps.begin());
  if (after == stamps.end()) return index - 1;
  return *after - stamp < stamp - *(after - 1) ? index : index - 1;
}

}  // namespace

std::int64_t median_period(std::span<const std::int64_t> stamps) {
  if (stamps.size() < 2) return 0;
  std::vector<std::int64_t> periods;
  for (std::size_t i = 1; i < stamps.size(); ++i) periods.push_back(stamps[i] - stamps[i - 1]);
  const auto middle = periods.begin() + static_cast<std::ptrdiff_t>(periods.size() / 2);
  std::nth_element(periods.begin(), middle, periods.end());
  return *middle;
}

std::int64_t default_tolerance(std::span<const std::int64_t> truth,
                               std::span<const std::int64_t> estimate) {
  constexpr std::int64_t kMost = 20'000'000;
  std::int64_t tolerance = kMost;
  for (const std::int64_t period : {median_period(truth), median_period(estimate)}) {
    if (period > 0) tolerance = std::min(tolerance, period / 2);
  }
  return tolerance;
}

std::vector<StampPair> associate(std::span<const std::int64_t> truth,
                                 std::span<const std::int64_t> estimate, std::int64_t tolerance) {
  std::vector<StampPair> pairs;
  if (truth.empty()) return pairs;
  const auto gap = [&](const StampPair& p) {
    return std::abs(truth[p.truth] - estimate[p.estimate]);
  };
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    const StampPair pair{nearest_index(truth, estimate[i]), i};
    if (gap(pair) > tolerance) continue;
    if (!pairs.empty() && pairs.back().truth == pair.truth) {
      if (gap(pair) < gap(pairs.back())) pairs.back() = pair;
      continue;
    }
    pairs.push_back(pair);
  }
  return pairs;
}

}  // namespace sovo
