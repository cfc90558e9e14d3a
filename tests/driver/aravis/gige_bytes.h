#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace sovo::gige {

/// GVCP and GVSP count in big-endian numbers.
using Bytes = std::vector<std::uint8_t>;

template <class T>
void append(T value, Bytes* bytes) {
  for (int shift = 8 * static_cast<int>(sizeof(T)) - 8; shift >= 0; shift -= 8) {
    bytes->push_back(static_cast<std::uint8_t>(value >> shift));
  }
}

inline std::uint64_t number(const Bytes& bytes, std::size_t at, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < size && at + i < bytes.size(); ++i)
    value = value << 8U | bytes[at + i];
  return value;
}

inline std::uint32_t word(const Bytes& bytes, std::size_t at) {
  return static_cast<std::uint32_t>(number(bytes, at, 4));
}

}  // namespace sovo::gige
