#include "sovo/bridge/stereo_frame_conversion.h"

#include <algorithm>
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

/// A row of an image, and those above and below it.
struct Rows {
  const std::uint8_t* above;
  const std::uint8_t* row;
  const std::uint8_t* below;
};

/// How a row of an encoding becomes grey.
using RowToGrey = void (*)(const Rows& rows, int width, std::uint8_t* grey);

/// ITU-R BT.601 luma in 14-bit fixed point; R and B are bytes kR and kB of a pixel of kBytes.
template <int kR, int kB, int kBytes>
void row_of_colour(const Rows& rows, int width, std::uint8_t* grey) {
  const std::uint8_t* pixel = rows.row;
  for (int x = 0; x < width; ++x, pixel += kBytes) {
    const int luma = 4899 * pixel[kR] + 9617 * pixel[1] + 1868 * pixel[kB] + 8192;
    grey[x] = static_cast<std::uint8_t>(luma >> 14);
  }
}

/// Y0 U Y1 V: every second byte.
void row_of_yuyv(const Rows& rows, int width, std::uint8_t* grey) {
  for (int x = 0; x < width; ++x) grey[x] = rows.row[2 * x];
}

/// The weights 1 2 1 in both directions give (R + 2 G + B) / 4 at every pixel of every Bayer
/// pattern, centred on it.
void row_of_bayer(const Rows& rows, int width, std::uint8_t* grey) {
  const auto column = [&](int x) { return rows.above[x] + 2 * rows.row[x] + rows.below[x]; };
  for (int x = 0; x < width; ++x) {
    const int left = x > 0 ? x - 1 : std::min(1, width - 1);
    const int right = x + 1 < width ? x + 1 : std::max(width - 2, 0);
    grey[x] = static_cast<std::uint8_t>((column(left) + 2 * column(x) + column(right) + 8) >> 4);
  }
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
    {"bgr8", 3, PixelFormat::kMono8, row_of_colour<2, 0, 3>},
    {"rgb8", 3, PixelFormat::kMono8, row_of_colour<0, 2, 3>},
    {"yuv422_yuy2", 2, PixelFormat::kMono8, row_of_yuyv},
    {"bgra8", 4, PixelFormat::kMono8, row_of_colour<2, 0, 4>},
    {"rgba8", 4, PixelFormat::kMono8, row_of_colour<0, 2, 4>},
    {"8UC1", 1, PixelFormat::kMono8, nullptr},
    {"bayer_rggb8", 1, PixelFormat::kMono8, row_of_bayer},
    {"bayer_bggr8", 1, PixelFormat::kMono8, row_of_bayer},
    {"bayer_gbrg8", 1, PixelFormat::kMono8, row_of_bayer},
    {"bayer_grbg8", 1, PixelFormat::kMono8, row_of_bayer},
};

std::string encoding_names() {
  std::string names;
  for (const Encoding& encoding : kEncodings) {
    names += (names.empty() ? "" : ", ") + std::string(encoding.name);
  }
  return names;
}

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
  const std::size_t last = m.height - 1;
  const auto row = [&m](std::size_t y) { return m.data._buffer + y * m.step; };
  for (std::size_t y = 0; y <= last; ++y) {
    // Mirrored at the edges, which keeps a Bayer pattern in step.
    const std::size_t above = y > 0 ? y - 1 : std::min<std::size_t>(1, last);
    const std::size_t below = y < last ? y + 1 : std::max<std::size_t>(last, 1) - 1;
    to_grey({row(above), row(y), row(below)}, static_cast<int>(m.width),
            grey->data() + y * m.width);
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
    return Error{name + ".encoding " + shown(m.encoding) + " is not one of " + encoding_names()};
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

Result<SideImage> from_message(const msg::Image& m, const std::string& name) {
  if (m.header.stamp.nanosec >= 1'000'000'000U) {
    return Error{name + ".header.stamp.nanosec " + std::to_string(m.header.stamp.nanosec) +
                 " is a second or more"};
  }
  msg::SideImage side{};
  side.valid = true;
  side.width = m.width;
  side.height = m.height;
  side.step = m.step;
  side.encoding = m.encoding;
  side.data = m.data;
  auto image = from_message(side, name);
  if (!image || m.is_bigendian == 0 || image->format != PixelFormat::kMono16) return image;
  auto swapped = std::make_shared<std::vector<std::uint8_t>>(*image->data);
  for (std::size_t y = 0; y < m.height; ++y) {
    std::uint8_t* row = swapped->data() + y * m.step;
    for (std::size_t x = 0; x < m.width; ++x) std::swap(row[2 * x], row[2 * x + 1]);
  }
  image->data = std::move(swapped);
  return image;
}

std::string short_text(const char* text) {
  return {text_or_empty(text), ::strnlen(text_or_empty(text), kLongestFrameId)};
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
