#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace sovo::test {

/// Sum of sinusoids over a plane, four at a time: rendering is most of what tests of whole drives
/// take, and sines are most of rendering. To 1e-15 of the amplitudes' sum, with the same bits
/// everywhere, where arguments are below 1e6.
class SineSum {
 public:
  void add(double ks, double kt, double phase, double amplitude) {
    if (size_ % kWide == 0) blocks_.emplace_back();
    Block& block = blocks_.back();
    const std::size_t lane = size_++ % kWide;
    block.ks[lane] = ks;
    block.kt[lane] = kt;
    block.phase[lane] = phase;
    block.amplitude[lane] = amplitude;
  }

  void scale(double factor) {
    for (Block& block : blocks_) block.amplitude *= factor;
  }

  /// Optimized whatever the rest of a test is built with.
  [[gnu::optimize("O3", "fp-contract=off"), gnu::no_sanitize_address]] double operator()(
      double s, double t) const {
    Wide sum{};
    for (const Block& b : blocks_) sum += b.amplitude * sine(b.ks * s + b.kt * t + b.phase);
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
  }

 private:
  static constexpr std::size_t kWide = 4;
  using Wide = double __attribute__((vector_size(32)));
  using WideInt = std::int64_t __attribute__((vector_size(32)));
  struct Block {
    Wide ks{}, kt{}, phase{}, amplitude{};
  };

  /// Of x - n pi by its Taylor series, which is exact at 1.6; n odd turns the sign.
  [[gnu::always_inline]] static inline Wide sine(const Wide& x) {
    constexpr double kRound = 6755399441055744.0;  // 1.5 * 2^52: what is added to it is rounded
    constexpr double kPi = 3.141592653589793116;   // in three parts
    constexpr double kPiRest = 1.224646799147353207e-16;
    const Wide rounded = x * (1.0 / kPi) + kRound;
    const Wide n = rounded - kRound;
    // n has so few bits that n times this half of pi's is exact.
    constexpr double kPiHigh = 3.1415926218032836914;  // 30 bits
    const Wide r = ((x - n * kPiHigh) - n * (kPi - kPiHigh)) - n * kPiRest;
    const Wide r2 = r * r;
    Wide p = r2 * (1.0 / 51090942171709440000.0) - 1.0 / 121645100408832000.0;
    p = p * r2 + 1.0 / 355687428096000.0;
    p = p * r2 - 1.0 / 1307674368000.0;
    p = p * r2 + 1.0 / 6227020800.0;
    p = p * r2 - 1.0 / 39916800.0;
    p = p * r2 + 1.0 / 362880.0;
    p = p * r2 - 1.0 / 5040.0;
    p = p * r2 + 1.0 / 120.0;
    p = p * r2 - 1.0 / 6.0;
    const Wide value = r + r * (r2 * p);
    WideInt odd, bits;
    std::memcpy(&odd, &rounded, sizeof(odd));
    std::memcpy(&bits, &value, sizeof(bits));
    bits ^= odd << 63;
    Wide out;
    std::memcpy(&out, &bits, sizeof(out));
    return out;
  }

  std::vector<Block> blocks_;
  std::size_t size_ = 0;
};

}  // namespace sovo::test
