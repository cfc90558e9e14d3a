#include "sovo/driver/live/device_clock.h"

#include <algorithm>
#include <cmath>

namespace sovo {
namespace {

constexpr std::size_t kFewBins = 3;  // fewer tell nothing of drift or spread
constexpr double kMadToSigma = 1.4826;

double seconds(std::int64_t ns) { return 1e-9 * static_cast<double>(ns); }

/// The value with `share` of the others below it; reorders `values`.
double quantile(std::vector<double>* values, double share) {
  const auto n = static_cast<std::ptrdiff_t>(share * static_cast<double>(values->size() - 1));
  std::nth_element(values->begin(), values->begin() + n, values->end());
  return (*values)[static_cast<std::size_t>(n)];
}

}  // namespace

DeviceClock::DeviceClock(const DeviceClockConfig& config) : config_(config) {
  const auto n = static_cast<std::size_t>(config_.max_bins) + 1;
  bins_.reserve(n);
  scratch_.reserve(n * n / 2);
}

void DeviceClock::restart(std::int64_t device_ns, std::int64_t utc_ns) {
  valid_ = true;
  origin_device_ns_ = device_ns;
  origin_offset_ns_ = utc_ns - device_ns;
  bins_.clear();
  bin_end_s_ = 0.0;
  slope_ = 0.0;
  offset_s_ = 0.0;
  mean_delay_s_ = 0.0;
  sigma_s_ = std::max(config_.first_sigma_s, config_.sigma_floor_s);
  odd_readings_ = 0;
}

/// Counts readings that agree with each other and not with the fit.
bool DeviceClock::is_step(std::int64_t device_ns, double residual_s) {
  // No device goes back by itself: it was started anew.
  if (device_ns < last_device_ns_) return true;
  if (std::abs(residual_s) < config_.step_s) {
    odd_readings_ = 0;
    return false;
  }
  const bool agrees =
      odd_readings_ > 0 && std::abs(residual_s - odd_residual_s_) < 0.5 * config_.step_s;
  odd_readings_ = agrees ? odd_readings_ + 1 : 1;
  if (!agrees) {
    odd_residual_s_ = residual_s;
    odd_since_ns_ = device_ns;
  }
  // Nothing arrives before it was stamped: early readings are no accident.
  const double least_s = residual_s > 0.0 ? config_.late_step_s : 0.0;
  return odd_readings_ >= config_.step_readings && seconds(device_ns - odd_since_ns_) >= least_s;
}

void DeviceClock::observe(std::int64_t device_ns, std::int64_t utc_ns) {
  if (!valid_) restart(device_ns, utc_ns);
  const double residual = seconds(utc_ns - to_utc(device_ns));
  if (is_step(device_ns, residual)) {
    ++steps_;
    restart(device_ns, utc_ns);
  }
  last_device_ns_ = device_ns;
  if (odd_readings_ > 0) return;
  const Bin reading{seconds(device_ns - origin_device_ns_),
                    seconds(utc_ns - device_ns - origin_offset_ns_)};
  add_to_bin(reading);
  if (bins_.size() < kFewBins) {
    // The promptest reading so far; the mean delay over it stands for its uncertainty.
    offset_s_ = std::min(offset_s_, reading.offset_s);
    mean_delay_s_ += 0.1 * (reading.offset_s - offset_s_ - mean_delay_s_);
    sigma_s_ = std::max({mean_delay_s_, config_.first_sigma_s, config_.sigma_floor_s});
  }
}

void DeviceClock::add_to_bin(const Bin& reading) {
  if (bins_.empty() || reading.device_s >= bin_end_s_) {
    if (bins_.size() >= kFewBins) fit();
    bins_.push_back(reading);
    if (bins_.size() > static_cast<std::size_t>(config_.max_bins)) bins_.erase(bins_.begin());
    bin_end_s_ = reading.device_s + config_.bin_s;
  } else if (reading.offset_s - slope_ * reading.device_s <
             bins_.back().offset_s - slope_ * bins_.back().device_s) {
    bins_.back() = reading;
  }
}

void DeviceClock::fit() {
  scratch_.clear();
  for (std::size_t i = 0; i < bins_.size(); ++i) {
    for (std::size_t j = i + 1; j < bins_.size(); ++j) {
      const double dt = bins_[j].device_s - bins_[i].device_s;
      if (dt >= 0.5 * config_.bin_s) {
        scratch_.push_back((bins_[j].offset_s - bins_[i].offset_s) / dt);
      }
    }
  }
  slope_ = scratch_.empty() ? 0.0 : quantile(&scratch_, 0.5);
  slope_ = std::clamp(slope_, -config_.max_drift, config_.max_drift);
  scratch_.clear();
  for (const Bin& bin : bins_) scratch_.push_back(bin.offset_s - slope_ * bin.device_s);
  offset_s_ = quantile(&scratch_, 0.25);
  for (double& residual : scratch_) residual = std::abs(residual - offset_s_);
  sigma_s_ = std::max(config_.sigma_floor_s, kMadToSigma * quantile(&scratch_, 0.5));
}

std::int64_t DeviceClock::to_utc(std::int64_t device_ns) const {
  const double offset = offset_s_ + slope_ * seconds(device_ns - origin_device_ns_);
  return device_ns + origin_offset_ns_ + static_cast<std::int64_t>(std::llround(1e9 * offset));
}

}  // namespace sovo
