#pragma once

#include "sovo/driver/live/auto_exposure.h"

namespace sovo {

/// Exposure control of our own, as it is configured.
struct AutoExposureOptions {
  bool enabled = false;
  double target_grey = 105.0;
  double first_ms = 5.0;
  double min_ms = 0.05;
  double max_ms = 10.0;
  double max_gain_db = 0.0;
  double max_step = 0.05;

  template <class Visitor>
  void visit(Visitor& v) {
    v("enabled", enabled, "both cameras get the same exposure and gain, which change slowly");
    v("target_grey", target_grey, "mean grey level that is aimed at");
    v("first_ms", first_ms, "exposure to begin with [ms]");
    v("min_ms", min_ms, "shortest exposure [ms]");
    v("max_ms", max_ms, "longest exposure [ms]; then the gain rises");
    v("max_gain_db", max_gain_db, "largest gain [dB]; V4L2 cameras have no gain in dB");
    v("max_step", max_step, "largest change of light at a time, as a share");
  }

  AutoExposureConfig config() const {
    AutoExposureConfig c;
    c.target_grey = target_grey;
    c.min_exposure_s = 1e-3 * min_ms;
    c.max_exposure_s = 1e-3 * max_ms;
    c.max_gain_db = max_gain_db;
    c.max_step = max_step;
    c.first = {1e-3 * first_ms, 0.0};
    return c;
  }
};

/// What all drivers of real cameras share.
struct LiveOptions {
  double pair_tolerance_ms = 0.0;
  double stall_s = 2.0;
  double longest_wait_s = 1.0;
  AutoExposureOptions auto_exposure;

  template <class Visitor>
  void visit(Visitor& v) {
    v("pair_tolerance_ms", pair_tolerance_ms,
      "largest time between the exposures of a pair [ms]; 0: a quarter of the frame period");
    v("stall_s", stall_s, "silence after which a camera is opened anew [s]");
    v("longest_wait_s", longest_wait_s, "longest wait between two attempts to open it [s]");
    v("auto_exposure", auto_exposure, "exposure control of our own");
  }

  /// Tolerance of pairs at a frame rate [ns].
  std::int64_t tolerance_ns(double frame_rate) const {
    if (pair_tolerance_ms > 0.0) return static_cast<std::int64_t>(1e6 * pair_tolerance_ms);
    return static_cast<std::int64_t>(0.25e9 / (frame_rate > 0.0 ? frame_rate : 30.0));
  }
};

}  // namespace sovo
