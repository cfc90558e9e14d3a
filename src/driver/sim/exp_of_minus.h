#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

namespace sovo::sim {

/// exp(-x) for x >= 0, to a millionth; the same on every machine.
inline float exp_of_minus(float x) {
  const float power = std::max(-126.0F, -1.44269504F * x);
  const auto whole = static_cast<std::int32_t>(power);
  // 2^f, -1 < f <= 0, by its series about -1/2.
  const float f = 0.69314718F * (power - static_cast<float>(whole) + 0.5F);
  const float series =
      1.0F + f * (1.0F + f * (0.5F + f * (0.16666667F + f * (0.041666667F + f * 0.0083333333F))));
  return 0.70710678F * series * std::bit_cast<float>((whole + 127) << 23);
}

}  // namespace sovo::sim
