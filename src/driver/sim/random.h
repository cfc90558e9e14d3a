#pragma once

#include <cstdint>

namespace sovo::sim {

/// Scrambles 64 bits (Steele, Lea, Flood, "Fast splittable pseudorandom number generators").
constexpr std::uint64_t scramble(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15ULL;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBULL;
  return x ^ (x >> 31);
}

/// One stream seed of two numbers.
constexpr std::uint64_t combine(std::uint64_t a, std::uint64_t b) {
  return scramble(scramble(a) ^ (b * 0xD6E8FEB86659FD93ULL));
}

/// Uniform in [0, 1) from 64 random bits.
constexpr double unit(std::uint64_t bits) { return static_cast<double>(bits >> 11) * 0x1.0p-53; }

/// Random numbers whose bytes are the same with every library.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(scramble(seed)) {}

  std::uint64_t bits() { return scramble(state_++); }
  double uniform() { return unit(bits()); }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  float uniform_float(double low, double high) { return static_cast<float>(uniform(low, high)); }
  /// A whole number in [0, n).
  int below(int n) { return static_cast<int>(uniform() * n); }
  bool chance(double p) { return uniform() < p; }

 private:
  std::uint64_t state_;
};

}  // namespace sovo::sim
