#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <random>
#include <span>
#include <type_traits>

#include "sovo/image/image.h"

/// For tests whose suite is called SameBits: a kernel's result from an input that is exact on every
/// machine, held to a checksum. They pass on x86-64 and on arm64, so both compute the same bits. A
/// change of a kernel's arithmetic changes its checksum: then the new one is right when both
/// machines, the release and the sanitized builds give it.
namespace sovo::test {

/// FNV-1a over the bytes of numbers, in their order.
class Checksum {
 public:
  template <class T>
  void add(const T& number) {
    static_assert(std::is_arithmetic_v<T>);
    unsigned char bytes[sizeof(T)];
    std::memcpy(bytes, &number, sizeof(T));
    for (const unsigned char byte : bytes) value_ = (value_ ^ byte) * 0x100000001b3U;
  }
  template <class T, std::size_t kSize>
  void add(std::span<T, kSize> numbers) {
    for (const auto& number : numbers) add(number);
  }
  void add(const ImageF& image) { add(std::span(image.data(), image.size())); }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325U;
};

/// Grey levels in steps of 1/64, with structure at 8 px and at 1 px: sums and products of whole
/// numbers, no function whose last bit is the library's affair.
inline ImageF noise_image(int width, int height, unsigned seed) {
  constexpr int kCell = 8;
  std::mt19937 random(seed);
  const int columns = width / kCell + 2;
  Image<int> nodes(columns, height / kCell + 2);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    nodes.data()[i] = static_cast<int>(random() % 200U);
  }
  ImageF image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int i = x / kCell;
      const int j = y / kCell;
      const int fx = x % kCell;
      const int fy = y % kCell;
      const int upper = (kCell - fx) * nodes.at(i, j) + fx * nodes.at(i + 1, j);
      const int lower = (kCell - fx) * nodes.at(i, j + 1) + fx * nodes.at(i + 1, j + 1);
      const int noise = static_cast<int>(random() % 640U);
      image.at(x, y) = static_cast<float>((kCell - fy) * upper + fy * lower + noise) / 64.0F;
    }
  }
  return image;
}

}  // namespace sovo::test
