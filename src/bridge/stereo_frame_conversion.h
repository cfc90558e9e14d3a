#pragma once

#include "message_traits.h"
#include "sovo/image/stereo_frame.h"
#include "sovo/io/result.h"

namespace sovo::bridge {

/// Largest width or height [px] of an image that is believed.
inline constexpr std::uint32_t kLargestImage = 16384;

/// Whether a side holds an image: valid, with as much data as its size says.
bool has_pixels(const SideImage& side);

/// Message of a frame; it borrows from `frame` (borrow.h): no pixel is copied.
msg::StereoFrame to_message(const StereoFrame& frame);

/// Frame of a message that anyone may have sent: sizes, steps, encodings and numbers are checked,
/// and the error says which field is wrong. Colour (bgr8, rgb8, yuv422_yuy2) becomes grey.
Result<StereoFrame> from_message(const msg::StereoFrame& message);

/// One side of a frame, as above; `name` is for the error text.
Result<SideImage> from_message(const msg::SideImage& message, const std::string& name);

}  // namespace sovo::bridge
