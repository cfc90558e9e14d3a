#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "sovo/image/stereo_frame.h"
#include "sovo/io/result.h"

namespace sovo {

/// A decoded grey image, rows tightly packed; 16-bit values are little endian.
struct GreyImage {
  int width = 0;   ///< [px]
  int height = 0;  ///< [px]
  PixelFormat format = PixelFormat::kMono8;
  std::vector<std::uint8_t> data;

  int bytes_per_pixel() const { return format == PixelFormat::kMono16 ? 2 : 1; }
  int step() const { return width * bytes_per_pixel(); }
};

/// Decodes PNG (1 to 16 bit), PGM or PPM (binary, 8 and 16 bit) and JPEG, told apart by content.
/// Colour becomes grey by Rec. 601 luma; transparency is dropped. The error says what is wrong
/// with the content. Images of more than 2^28 pixels are refused.
Result<GreyImage> decode_grey_image(std::span<const std::uint8_t> bytes);

/// Reads and decodes a file; the error names the file and the reason.
Result<GreyImage> read_grey_image(const std::string& path);

/// The image as one side of a pair.
SideImage to_side(GreyImage image);

/// Writes an 8- or 16-bit grey PNG; the error names the file and the reason.
Result<void> write_png(const std::string& path, const GreyImage& image);

}  // namespace sovo
