#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sovo/image/stereo_frame.h"

namespace sovo::aravis {

/// What a GigE Vision camera's bytes mean, of those that become grey.
enum class SensorFormat {
  kMono8,
  kMono10,        ///< In 16 bits, little endian, at the lower end; as is Mono12.
  kMono10Packed,  ///< GigE Vision's own: upper bytes of two pixels, their lower bits between.
  kMono10p,       ///< Bits in a row, lowest first.
  kMono12,
  kMono12Packed,
  kMono12p,
  kMono16,
  kBayer8,  ///< Any order of colours.
};

constexpr int bits_per_pixel(SensorFormat format) {
  switch (format) {
    case SensorFormat::kMono8:
    case SensorFormat::kBayer8:
      return 8;
    case SensorFormat::kMono10p:
      return 10;
    case SensorFormat::kMono10Packed:
    case SensorFormat::kMono12Packed:
    case SensorFormat::kMono12p:
      return 12;
    default:
      return 16;
  }
}

/// The format of the grey image that comes of it.
constexpr PixelFormat grey_format(SensorFormat format) {
  return bits_per_pixel(format) == 8 ? PixelFormat::kMono8 : PixelFormat::kMono16;
}
constexpr int bytes_per_grey(SensorFormat format) {
  return grey_format(format) == PixelFormat::kMono8 ? 1 : 2;
}

/// Makes grey images, rows tightly packed, 16 bits brought to full scale. Colours of a Bayer
/// pattern are summed as 1 : 2 : 1 by a binomial filter, which every place of the pattern sees
/// alike.
class GreyReader {
 public:
  /// False when `bytes` are too few, or the image is smaller than 2x2. Precondition: `grey` has
  /// width * height pixels of `grey_format`.
  bool read(SensorFormat format, std::span<const std::uint8_t> bytes, int width, int height,
            std::uint8_t* grey);

 private:
  void filter_bayer(std::span<const std::uint8_t> bytes, int width, int height, std::uint8_t* grey);

  std::vector<std::uint16_t> sums_;  ///< Of three rows, weighted.
};

}  // namespace sovo::aravis
