#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

namespace sovo::test {

using Bytes = std::vector<std::uint8_t>;

inline constexpr std::uint32_t kTicks = 10'000'000;  ///< Of a frame interval, a second.

inline void append(Bytes* bytes, std::initializer_list<int> values) {
  for (const int v : values) bytes->push_back(static_cast<std::uint8_t>(v));
}
inline void append16(Bytes* bytes, std::uint32_t v) {
  append(bytes, {static_cast<int>(v & 255U), static_cast<int>((v >> 8) & 255U)});
}
inline void append32(Bytes* bytes, std::uint32_t v) {
  append16(bytes, v);
  append16(bytes, v >> 16);
}
inline void put32(Bytes* bytes, std::size_t at, std::uint32_t v) {
  for (std::size_t i = 0; i < 4; ++i) (*bytes)[at + i] = static_cast<std::uint8_t>(v >> (8 * i));
}
inline std::uint32_t get32(const Bytes& bytes, std::size_t at) {
  std::uint32_t v = 0;
  for (std::size_t i = 0; i < 4; ++i) v |= std::uint32_t{bytes[at + i]} << (8 * i);
  return v;
}

/// A size of the camera and its rates, falling.
struct UvcMode {
  std::uint32_t width;
  std::uint32_t height;
  std::vector<std::uint32_t> rates;
  std::uint32_t bytes() const { return width * height * 2; }
};

/// A control of a unit: two bytes, or one.
struct UvcControl {
  int unit;
  int selector;
  int size;
  int least;
  int most;
  int step;
  int preset;
  int value;
};

/// A camera as it tells of itself.
struct UvcModel {
  std::uint32_t vendor;
  std::uint32_t product;
  std::string maker;
  std::string name;
  std::string serial;
  std::vector<UvcMode> modes;
};

/// A ZED, whose images have both sides.
UvcModel zed_model();
/// A camera of one side.
UvcModel eye_model(bool right);
/// The standard controls of a ZED, and exposure time and automatic exposure as other cameras have
/// them.
std::vector<UvcControl> usual_controls();

Bytes device_descriptor(const UvcModel& model);
Bytes configuration_descriptor(const std::vector<UvcMode>& modes);
Bytes string_descriptor(const std::string& text);

}  // namespace sovo::test
