#include "sovo/driver/aravis/grey_image.h"

#include <cstddef>
#include <cstring>

namespace sovo::aravis {
namespace {

using Bytes = std::span<const std::uint8_t>;

void put(unsigned value, std::size_t i, std::uint8_t* grey) {
  grey[2 * i] = static_cast<std::uint8_t>(value);
  grey[2 * i + 1] = static_cast<std::uint8_t>(value >> 8U);
}

/// Pixels of 16 bits, of which the lower ones are used.
void shift_up(Bytes bytes, std::size_t pixels, unsigned shift, std::uint8_t* grey) {
  for (std::size_t i = 0; i < pixels; ++i) {
    const unsigned value = bytes[2 * i] | static_cast<unsigned>(bytes[2 * i + 1]) << 8U;
    put(value << shift, i, grey);
  }
}

/// Two pixels in three bytes, the lower bits of both in the middle one.
void unpack_pairs(Bytes bytes, std::size_t pixels, unsigned low_bits, std::uint8_t* grey) {
  const unsigned mask = (1U << low_bits) - 1U;
  for (std::size_t i = 0; i < pixels; ++i) {
    const std::size_t at = i / 2 * 3;
    const bool second = i % 2 == 1;
    const unsigned high = bytes[second ? at + 2 : at];
    const unsigned low = (second ? bytes[at + 1] >> 4U : bytes[at + 1]) & mask;
    put((high << low_bits | low) << (8U - low_bits), i, grey);
  }
}

/// Bits in a row, lowest first; a pixel never spans more than two bytes.
void unpack_bits(Bytes bytes, std::size_t pixels, unsigned bits, std::uint8_t* grey) {
  const unsigned mask = (1U << bits) - 1U;
  for (std::size_t i = 0; i < pixels; ++i) {
    const std::size_t at = i * bits / 8;
    const auto shift = static_cast<unsigned>(i * bits % 8);
    const unsigned value = bytes[at] | static_cast<unsigned>(bytes[at + 1]) << 8U;
    put((value >> shift & mask) << (16U - bits), i, grey);
  }
}

std::size_t bytes_of(SensorFormat format, std::size_t pixels) {
  switch (format) {
    case SensorFormat::kMono10Packed:
    case SensorFormat::kMono12Packed:
      return (pixels + 1) / 2 * 3;
    default:
      return (pixels * static_cast<std::size_t>(bits_per_pixel(format)) + 7) / 8;
  }
}

}  // namespace

bool GreyReader::read(SensorFormat format, Bytes bytes, int width, int height, std::uint8_t* grey) {
  if (width < 2 || height < 2) return false;
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (bytes.size() < bytes_of(format, pixels)) return false;
  switch (format) {
    case SensorFormat::kMono8:
      std::memcpy(grey, bytes.data(), pixels);
      break;
    case SensorFormat::kMono10:
      shift_up(bytes, pixels, 6, grey);
      break;
    case SensorFormat::kMono10Packed:
      unpack_pairs(bytes, pixels, 2, grey);
      break;
    case SensorFormat::kMono10p:
      unpack_bits(bytes, pixels, 10, grey);
      break;
    case SensorFormat::kMono12:
      shift_up(bytes, pixels, 4, grey);
      break;
    case SensorFormat::kMono12Packed:
      unpack_pairs(bytes, pixels, 4, grey);
      break;
    case SensorFormat::kMono12p:
      unpack_bits(bytes, pixels, 12, grey);
      break;
    case SensorFormat::kMono16:
      std::memcpy(grey, bytes.data(), 2 * pixels);
      break;
    case SensorFormat::kBayer8:
      filter_bayer(bytes, width, height, grey);
      break;
  }
  return true;
}

/// 1 2 1 / 2 4 2 / 1 2 1 over 16, mirrored at the border so that the pattern goes on.
void GreyReader::filter_bayer(Bytes bytes, int width, int height, std::uint8_t* grey) {
  sums_.resize(static_cast<std::size_t>(width) + 2);
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* row = bytes.data() + std::ptrdiff_t{y} * width;
    const std::uint8_t* above = y > 0 ? row - width : row + width;
    const std::uint8_t* below = y + 1 < height ? row + width : row - width;
    std::uint16_t* sums = sums_.data() + 1;
    for (int x = 0; x < width; ++x) {
      sums[x] = static_cast<std::uint16_t>(above[x] + 2 * row[x] + below[x]);
    }
    sums[-1] = sums[1];
    sums[width] = sums[width - 2];
    std::uint8_t* out = grey + std::ptrdiff_t{y} * width;
    for (int x = 0; x < width; ++x) {
      out[x] = static_cast<std::uint8_t>((sums[x - 1] + 2 * sums[x] + sums[x + 1] + 8) / 16);
    }
  }
}

}  // namespace sovo::aravis
