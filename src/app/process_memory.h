#pragma once

namespace sovo::app {

/// Largest resident size of this process so far [MB of 10^6 bytes]; 0 when the system does not
/// tell.
double peak_memory_mb();

}  // namespace sovo::app
