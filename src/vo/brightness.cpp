#include "sovo/vo/brightness.h"

#include <cmath>

namespace sovo {

BrightnessTransfer brightness_transfer(const Affine& host, double host_exposure,
                                       const Affine& target, double target_exposure) {
  const bool known = host_exposure > 0.0 && target_exposure > 0.0;
  const double ratio = known ? target_exposure / host_exposure : 1.0;
  BrightnessTransfer out;
  out.gain = std::exp(target.a - host.a) * ratio;
  out.bias = target.b - out.gain * host.b;
  return out;
}

}  // namespace sovo
