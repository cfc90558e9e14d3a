#pragma once

#include <cstdint>

namespace sovo {

/// One instant on two clocks of this machine [ns].
struct HostClock {
  std::int64_t monotonic_ns = 0;  ///< CLOCK_MONOTONIC, which drivers stamp with.
  std::int64_t utc_ns = 0;        ///< CLOCK_REALTIME.
};

/// Reads both; when the reading was interrupted it is done anew.
HostClock read_host_clock();

}  // namespace sovo
