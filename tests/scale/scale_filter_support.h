#pragma once

#include "sovo/scale/scale_filter.h"

namespace sovo::test {

/// A measurement of a tenth of a median depth of way.
inline ScaleMeasurement measure(double log_scale, double sigma, bool cold = false,
                                ScaleVerdict verdict = ScaleVerdict::kAccepted) {
  ScaleMeasurement m;
  m.estimate.log_scale = log_scale;
  m.estimate.sigma = sigma;
  m.estimate.verdict = verdict;
  m.cold_start = cold;
  m.distance = 0.1;
  return m;
}

/// One that stereo depth of one pair has locked.
inline ScaleFilter locked_filter(const ScaleFilterConfig& config = {}) {
  ScaleFilter filter(config);
  filter.lock_initial(0.02, 0);
  return filter;
}

}  // namespace sovo::test
