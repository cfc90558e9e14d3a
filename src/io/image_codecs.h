#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sovo/io/image_file.h"
#include "sovo/io/result.h"

namespace sovo::codecs {

/// Largest image that is accepted [px]; a damaged header must not exhaust the memory.
inline constexpr std::int64_t kMaxPixels = std::int64_t{1} << 28;

/// Grey (channels 1) or RGB (3), 8 bit or 16 bit in the machine's order, tightly packed.
struct RawPixels {
  int width = 0;
  int height = 0;
  int channels = 1;
  int bits = 8;
  std::vector<std::uint8_t> data;
};

Result<RawPixels> decode_png(std::span<const std::uint8_t> bytes);
Result<RawPixels> decode_jpeg(std::span<const std::uint8_t> bytes);
Result<RawPixels> decode_pnm(std::span<const std::uint8_t> bytes);
Result<std::vector<std::uint8_t>> encode_png(const GreyImage& image);

}  // namespace sovo::codecs
