#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace sovo {

/// Indices of a pose of the truth and one of the estimate at the same instant.
struct StampPair {
  std::size_t truth = 0;
  std::size_t estimate = 0;
};

/// Median time between neighbours [ns]; 0 for fewer than two stamps.
std::int64_t median_period(std::span<const std::int64_t> stamps);

/// Half the shorter of the two median periods, at most 20 ms [ns].
std::int64_t default_tolerance(std::span<const std::int64_t> truth,
                               std::span<const std::int64_t> estimate);

/// Pairs each stamp of the estimate with the nearest one of the truth when they differ by at most
/// `tolerance` [ns]. A stamp of the truth serves once, for the nearest. Both must ascend, and so do
/// the pairs.
std::vector<StampPair> associate(std::span<const std::int64_t> truth,
                                 std::span<const std::int64_t> estimate, std::int64_t tolerance);

}  // namespace sovo
