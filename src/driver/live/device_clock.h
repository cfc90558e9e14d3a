#pragma once

#include <cstdint>
#include <vector>

namespace sovo {

struct DeviceClockConfig {
  double bin_s = 1.0;            ///< Of the readings of this long only the promptest counts [s].
  int max_bins = 60;             ///< Length of the fit's window.
  double step_s = 0.05;          ///< Readings this far off the fit may be a step [s].
  int step_readings = 5;         ///< Readings in a row that make it one.
  double late_step_s = 2.0;      ///< How long late ones must go on for it: a busy host is late too.
  double max_drift = 1e-3;       ///< No crystal is worse; a larger slope is not believed.
  double first_sigma_s = 1e-3;   ///< Uncertainty until the spread of the readings is known [s].
  double sigma_floor_s = 10e-6;  ///< Uncertainty that no data removes [s].
};

/// A device's clock against UTC: offset and drift, fitted continuously to pairs of readings, of
/// which the host's may be late but never early (an image arrives after it was stamped).
///
/// The delay is one-sided, so of each bin the reading with the least delay is kept. The slope is
/// the median of the slopes between bins (Theil-Sen), the offset a low quartile above it. A clock
/// that was set, on either side, shows as readings in a row that agree with each other and not with
/// the fit: it is then made anew and counted. Late readings after a stall of the host do not agree
/// with each other and are let pass; those of a busy host may agree, but not for long.
class DeviceClock {
 public:
  explicit DeviceClock(const DeviceClockConfig& config = {});

  /// The device's clock showed `device_ns` at or before the instant `utc_ns`.
  void observe(std::int64_t device_ns, std::int64_t utc_ns);

  /// UTC of a device stamp. Precondition: `valid()`.
  std::int64_t to_utc(std::int64_t device_ns) const;

  /// Whether there was a reading.
  bool valid() const { return valid_; }
  /// Standard deviation of what `to_utc` gives [s]. A constant part of the delay stays hidden.
  double sigma_s() const { return sigma_s_; }
  /// Seconds that UTC gains on the device a second.
  double drift() const { return slope_; }
  /// How often a clock was set.
  std::uint64_t steps() const { return steps_; }

 private:
  struct Bin {
    double device_s = 0.0;  ///< Since `origin_device_ns_`.
    double offset_s = 0.0;  ///< UTC less device time, since `origin_offset_ns_`.
  };

  void restart(std::int64_t device_ns, std::int64_t utc_ns);
  bool is_step(std::int64_t device_ns, double residual_s);
  void add_to_bin(const Bin& reading);
  void fit();

  DeviceClockConfig config_;
  bool valid_ = false;
  std::int64_t origin_device_ns_ = 0;
  std::int64_t origin_offset_ns_ = 0;
  std::int64_t last_device_ns_ = 0;
  std::vector<Bin> bins_;        ///< Oldest first; the last one is still filling.
  double bin_end_s_ = 0.0;       ///< Device time at which the last bin is full.
  std::vector<double> scratch_;  ///< Of `fit`.
  double slope_ = 0.0;
  double offset_s_ = 0.0;  ///< At device time 0 since the origin.
  double sigma_s_ = 0.0;
  double mean_delay_s_ = 0.0;  ///< Of the readings over the fit, as long as there are few bins.
  int odd_readings_ = 0;       ///< In a row, off the fit by about `odd_residual_s_`.
  double odd_residual_s_ = 0.0;
  std::int64_t odd_since_ns_ = 0;  ///< Device time of the first of them.
  std::uint64_t steps_ = 0;
};

}  // namespace sovo
