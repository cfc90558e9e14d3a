#pragma once

#include <array>

#include "sovo/vo/direct_config.h"
#include "sovo/vo/window.h"

namespace sovo {

/// For how long images are exposed of which nothing says so, as far as their blur tells: the time
/// with which the photometric residuals into new keyframes are least.
class ExposureEstimate {
 public:
  explicit ExposureEstimate(const MotionBlurConfig& config) : config_(config) {}

  /// Sets how the window's keyframes moved while they were exposed, with residuals into the newest
  /// one as evidence. A camera that was knocked moved otherwise than it seemed: that one's velocity
  /// is halved, zero, or forgotten where this fits clearly better.
  void settle(const WindowConfig& config, Window* window);

  /// Of images that do not tell [s]; 0 while no blur is seen.
  double seconds() const { return seconds_; }

 private:
  /// Doubling: 0.6 to 1.2 times the true time is as good (docs/method.md).
  static constexpr std::array kTimes = {0.0, 0.0025, 0.005, 0.01, 0.02, 0.04};

  bool is_due(double nearest, Window* window);
  void observe(const WindowConfig& config, double nearest, Window* window);

  MotionBlurConfig config_;
  std::array<double, kTimes.size()> energies_{};
  double seconds_ = 0.0;
  int observed_ = 0;  ///< Keyframes.
};

/// Energy of some of the photometric residuals into the newest keyframe, at the present estimate.
/// Outliers count their threshold.
double energy_into_newest(const WindowConfig& config, const Window& window);

}  // namespace sovo
