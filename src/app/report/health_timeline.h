#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sovo/app/report/dive.h"

namespace sovo::app {

/// A time during which the odometry was in one state, or said nothing.
struct HealthPeriod {
  /// As VoStatus, or kSilent.
  std::uint8_t state = 0;
  double begin_s = 0.0;  ///< Since the recording began.
  double end_s = 0.0;
  std::size_t frames = 0;
  std::string reason;  ///< Those that were given, as last worded; a handful at most.

  double duration_s() const { return end_s - begin_s; }
};

/// No status came, while the odometry tells one a frame.
inline constexpr std::uint8_t kSilent = 255;

/// State in words for a heading; unknown ones by number.
std::string state_name(std::uint8_t state);

/// The whole time from the first to the last status, without gaps. A period lasts until the next
/// status of another state. Silence is more than a second, and than five usual periods.
std::vector<HealthPeriod> health_timeline(const Dive& dive);

/// Time in a state [s].
double time_in(const std::vector<HealthPeriod>& periods, std::uint8_t state);

}  // namespace sovo::app
