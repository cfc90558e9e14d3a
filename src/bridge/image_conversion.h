#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "message_traits.h"
#include "sovo/image/stereo_frame.h"

namespace sovo::bridge {

/// An 8-bit grey image that lies somewhere else.
struct GreyView {
  const std::uint8_t* data = nullptr;
  int width = 0;
  int height = 0;
  int step = 0;  ///< Bytes from one row to the next.
};

/// Image message of a side; it borrows everything (borrow.h). Precondition: has_pixels(side).
msg::Image to_image(const SideImage& side, const msg::Header& header);

/// The side with 8 bits a pixel: as it lies, or the upper bytes of 16 bits, made in `storage`.
/// Precondition: has_pixels(side).
GreyView grey_view(const SideImage& side, std::vector<std::uint8_t>* storage);

/// The image reduced to `width` pixels a row, means of blocks, made in `storage`; an image that is
/// not wider stays as it is.
GreyView reduced(const GreyView& image, int width, std::vector<std::uint8_t>* storage);

}  // namespace sovo::bridge
