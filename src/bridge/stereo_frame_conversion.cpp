#include "sovo/bridge/stereo_frame_conversion.h"

#include <cmath>
#include <cstring>
#include <string>

#include "sovo/bridge/borrow.h"
#include "sovo/bridge/ros_conversion.h"

namespace sovo::bridge {
namespace {

constexpr std::size_t kLongestFrameId = 256;
constexpr std::int64_t kLargestOffsetNs = 10'000'000'000;

using Pixels = std::shared_ptr<const std::vector<std::uint8_t>>;

/// How a row of an encoding becomes grey.
using RowToGrey = void (*)(const std::uint8_t* row, int width, std::uint8_t* grey);

/// ITU-R BT.601 luma in 14-bit fixed point; R and B are bytes kR and kB of a pixel.
template <int kR, int kB>
void row_of_colour(const std::uint8_t* row, int width, std::uint8_t* grey) {
  for (int x = 0; x < width; ++x, row += 3) {
    const int luma = 4899 * row[kR] + 9617 * row[1] + 1868 * row[kB] + 8192;
    grey[x] = static_cast<std::uint8_t>(luma >> 14);
  }
}

/// Y0 U Y1 V: every second byte.
void row_of_yuyv(const std::uint8_t* row, int width, std::uint8_t* grey) {
  for (int x = 0; x < width; ++x) grey[x] = row[2 * x];
}

struct Encoding {
  const char* name;
  std::uint32_t bytes_per_pixel;
  PixelFormat format;
  RowToGrey to_grey;  ///< Null: already grey.
};

constexpr Encoding kEncodings[] = {
    {"mono8", 1, PixelFormat::kMono8, nullptr},
    {"mono16", 2, PixelFormat::kMono16, nullptr},
    {"bgr8", 3, PixelFormat::kMono8, row_of_colour<2, 0>},
    {"rgb8", 3, PixelFormat::kMono8, row_of_colour<0, 2>},
    {"yuv422_yuy2", 2, PixelFormat::kMono8, row_of_yuyv},
};

const Encoding* find_encoding(const char* name) {
  for (const Encoding& encoding : kEncodings) {
    if (std::strcmp(encoding.name, text_or_empty(name)) == 0) return &encoding;
  }
  return nullptr;
}

/// A name from the network, fit to be shown: short and printable.
std::string shown(const char* text) {
  std::string result(text_or_empty(text), ::strnlen(text_or_empty(text), 32));
  for (char& c : result) {
    if (c < ' ' || c > '~') c = '?';
  }
  return "'" + result + "'";
}

std::string size_text(const msg::SideImage& m) {
  return std::to_string(m.width) + "x" + std::to_string(m.height);
}

/// Empty when the sizes fit together.
std::string wrong_size(const msg::SideImage& m, const Encoding& encoding) {
  if (m.width == 0 || m.height == 0 || m.width > kLargestImage || m.height > kLargestImage) {
    return "size " + size_text(m) + " px is not between 1 and " + std::to_string(kLargestImage);
  }
  if (m.step < m.width * encoding.bytes_per_pixel) {
    return "step " + std::to_string(m.step) + " is too small for " + size_text(m) + " " +
           encoding.name;
  }
  const std::uint64_t expected = std::uint64_t{m.step} * m.height;
  if (m.data._length != expected || m.data._buffer == nullptr) {
    return "data has " + std::to_string(m.data._length) + " bytes, height * step is " +
           std::to_string(expected);
  }
  return {};
}

std::string wrong_numbers(const msg::SideImage& m) {
  if (!std::isfinite(m.exposure_s) || m.exposure_s < 0.0F) return "exposure_s is not a time";
  if (!std::isfinite(m.gain_db)) return "gain_db is not a number";
  if (m.stamp_offset_ns > kLargestOffsetNs || m.stamp_offset_ns < -kLargestOffsetNs) {
    return "stamp_offset_ns is more than 10 s";
  }
  return {};
}

Pixels copy_pixels(const msg::SideImage& m) {
  return std::make_shared<const std::vector<std::uint8_t>>(m.data._buffer,
                                                           m.data._buffer + m.data._length);
}

Pixels grey_pixels(const msg::SideImage& m, RowToGrey to_grey) {
  auto grey = std::make_shared<std::vector<std::uint8_t>>(std::size_t{m.width} * m.height);
  for (std::size_t y = 0; y < m.height; ++y) {
    to_grey(m.data._buffer + y * m.step, static_cast<int>(m.width), grey->data() + y * m.width);
  }
  return grey;
}

msg::SideImage to_message(const SideImage& side) {
  msg::SideImage m{};
  m.encoding = borrow(side.format == PixelFormat::kMono16 ? "mono16" : "mono8");
  m.exposure_s = side.exposure_s;
  m.gain_db = side.gain_db;
  m.stamp_offset_ns = side.stamp_offset_ns;
  m.dropped = side.dropped;
  // Data that does not fit the size is written as missing rather than read beyond its end.
  m.valid = has_pixels(side);
  if (!m.valid) return m;
  m.width = static_cast<std::uint32_t>(side.width);
  m.height = static_cast<std::uint32_t>(side.height);
  m.step = static_cast<std::uint32_t>(side.step);
  borrow(m.data, *side.data);
  return m;
}

}  // namespace

bool has_pixels(const SideImage& side) {
  const int bytes = side.format == PixelFormat::kMono16 ? 2 : 1;
  return side.valid && side.data && side.width > 0 && side.height > 0 &&
         side.step / bytes >= side.width &&
         side.data->size() == static_cast<std::size_t>(side.step) * side.height;
}

msg::StereoFrame to_message(const StereoFrame& frame) {
  msg::StereoFrame m{};
  m.header.stamp = to_message(frame.stamp_ns);
  m.header.frame_id = borrow(frame.frame_id);
  m.session = frame.session;
  m.sequence = frame.sequence;
  m.clock = frame.clock;
  m.stamp_sigma_s = frame.stamp_sigma_s;
  m.pair_error_s = frame.pair_error_s;
  m.left = to_message(frame.left);
  m.right = to_message(frame.right);
  return m;
}

Result<SideImage> from_message(const msg::SideImage& m, const std::string& name) {
  SideImage side;
  side.dropped = m.dropped;
  if (!m.valid) return side;
  const Encoding* encoding = find_encoding(m.encoding);
  if (encoding == nullptr) {
    return Error{name + ".encoding " + shown(m.encoding) +
                 " is not one of mono8, mono16, bgr8, rgb8, yuv422_yuy2"};
  }
  std::string wrong = wrong_size(m, *encoding);
  if (wrong.empty()) wrong = wrong_numbers(m);
  if (!wrong.empty()) return Error{name + ": " + wrong};
  side.valid = true;
  side.width = static_cast<int>(m.width);
  side.height = static_cast<int>(m.height);
  side.format = encoding->format;
  side.step = encoding->to_grey ? side.width : static_cast<int>(m.step);
  side.data = encoding->to_grey ? grey_pixels(m, encoding->to_grey) : copy_pixels(m);
  side.exposure_s = m.exposure_s;
  side.gain_db = m.gain_db;
  side.stamp_offset_ns = m.stamp_offset_ns;
  return side;
}

Result<StereoFrame> from_message(const msg::StereoFrame& m) {
  if (m.header.stamp.nanosec >= 1'000'000'000U) {
    return Error{"header.stamp.nanosec " + std::to_string(m.header.stamp.nanosec) +
                 " is a second or more"};
  }
  if (::strnlen(text_or_empty(m.header.frame_id), kLongestFrameId + 1) > kLongestFrameId) {
    return Error{"header.frame_id is longer than " + std::to_string(kLongestFrameId)};
  }
  if (!std::isfinite(m.stamp_sigma_s) || m.stamp_sigma_s < 0.0 || !std::isfinite(m.pair_error_s)) {
    return Error{"stamp_sigma_s or pair_error_s is not a number"};
  }
  auto left = from_message(m.left, "left");
  if (!left) return left.failure();
  auto right = from_message(m.right, "right");
  if (!right) return right.failure();
  StereoFrame frame;
  frame.stamp_ns = stamp_ns(m.header.stamp);
  frame.session = m.session;
  frame.sequence = m.sequence;
  frame.clock = m.clock;
  frame.stamp_sigma_s = m.stamp_sigma_s;
  frame.pair_error_s = m.pair_error_s;
  frame.frame_id = text_or_empty(m.header.frame_id);
  frame.left = std::move(*left);
  frame.right = std::move(*right);
  return frame;
}

}  // namespace sovo::bridge
