#pragma once

namespace sovo {

/// Affine brightness of a frame: its grey levels are exp(a) * (true) + b.
struct Affine {
  double a = 0.0;
  double b = 0.0;
};

/// Brightness from a host to a target image: I_target ~ gain * I_host + bias.
struct BrightnessTransfer {
  double gain = 1.0;
  double bias = 0.0;
};

/// Transfer between two frames; the exposure times count when both are known (> 0).
BrightnessTransfer brightness_transfer(const Affine& host, double host_exposure,
                                       const Affine& target, double target_exposure);

}  // namespace sovo
