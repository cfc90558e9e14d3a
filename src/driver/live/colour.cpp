#include "sovo/driver/live/colour.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace sovo {
namespace {

/// A camera's: those that wait for the caller, and for the thread that shows them.
constexpr std::size_t kColourImages = 8;
constexpr std::ptrdiff_t kRgb = 3;  // bytes of a pixel

bool has_colour(CameraFormat format) { return format != CameraFormat::kGrey; }

RawImage raw_view(const ColourImage& image) {
  return {image.format, image.width, image.height, image.stride, *image.bytes};
}

/// Where the values of a row lie. Two pixels side by side share their colour.
struct YuvRow {
  const std::uint8_t* luma;
  int luma_step;  ///< Bytes from one pixel to the next.
  const std::uint8_t* u;
  const std::uint8_t* v;
  int pair_step;  ///< Bytes from one pair's colour to the next.
};

YuvRow yuv_row(const RawImage& image, int y) {
  const std::uint8_t* row = image.bytes.data() + std::ptrdiff_t{y} * image.stride;
  if (image.format == CameraFormat::kYuyv) return {row, 2, row + 1, row + 3, 4};
  if (image.format == CameraFormat::kUyvy) return {row + 1, 2, row, row + 2, 4};
  const std::uint8_t* colour =
      image.bytes.data() + std::ptrdiff_t{image.height + y / 2} * image.stride;
  return {row, 1, colour, colour + 1, 2};
}

/// Thousandths, rounded to the nearest.
constexpr int rounded_thousandths(int value) { return (value + (value < 0 ? -500 : 500)) / 1000; }

std::uint8_t to_level(int value) { return static_cast<std::uint8_t>(std::clamp(value, 0, 255)); }

void convert_row(const YuvRow& row, int x, int count, std::uint8_t* rgb) {
  for (const int end = x + count; x < end; ++x, rgb += kRgb) {
    const std::ptrdiff_t pair = std::ptrdiff_t{x / 2} * row.pair_step;
    const int luma = row.luma[std::ptrdiff_t{x} * row.luma_step];
    const int u = row.u[pair] - 128;
    const int v = row.v[pair] - 128;
    rgb[0] = to_level(luma + rounded_thousandths(1402 * v));
    rgb[1] = to_level(luma - rounded_thousandths(344 * u + 714 * v));
    rgb[2] = to_level(luma + rounded_thousandths(1772 * u));
  }
}

}  // namespace

ColourImage ColourImage::half(bool right) const {
  ColourImage side = *this;
  side.columns = width / 2;
  side.first_column = right ? side.columns : 0;
  return side;
}

ColourImage ColourKeeper::keep(const RawImage& image) {
  if (!wanted_ || !*wanted_ || !has_colour(image.format)) {
    pool_.reset();
    return {};
  }
  if (!pool_) pool_.emplace(kColourImages, 0);
  const ImagePool::Buffer buffer = pool_->take();
  if (!buffer) {
    ++skipped_;
    return {};
  }
  // A buffer that was as large before has the room already.
  buffer->assign(image.bytes.begin(), image.bytes.end());
  ++kept_;
  return {image.format, image.width, image.height, image.stride, buffer, 0, image.width};
}

bool ColourReader::check(const ColourImage& image, const RawImage& raw) {
  problem_ = find_problem(raw);
  if (!problem_.empty()) return false;
  const bool pairs = raw.format != CameraFormat::kMjpeg;
  if (!has_colour(raw.format)) {
    problem_ = "the image has no colour";
  } else if (image.first_column < 0 || image.columns < 1 ||
             image.columns > image.width - image.first_column) {
    problem_ = "the side is not within the image";
  } else if (pairs &&
             (raw.width % 2 != 0 || (raw.format == CameraFormat::kNv12 && raw.height % 2 != 0))) {
    problem_ = "pixels that share a colour are not whole";
  }
  return problem_.empty();
}

bool ColourReader::read(const ColourImage& image, std::vector<std::uint8_t>* rgb) {
  if (!image.bytes) {
    problem_ = "the image has no colour";
    return false;
  }
  const RawImage raw = raw_view(image);
  if (!check(image, raw)) return false;
  const std::ptrdiff_t row_bytes = kRgb * image.columns;
  rgb->resize(static_cast<std::size_t>(row_bytes) * image.height);
  if (raw.format == CameraFormat::kMjpeg) return read_jpeg(image, raw, rgb->data());
  for (int y = 0; y < image.height; ++y) {
    convert_row(yuv_row(raw, y), image.first_column, image.columns, rgb->data() + y * row_bytes);
  }
  return true;
}

bool ColourReader::read_jpeg(const ColourImage& image, const RawImage& raw, std::uint8_t* rgb) {
  const std::ptrdiff_t whole_row = kRgb * image.width;
  // While we hold the bytes they are not filled anew: the same bytes are the same image.
  if (decoded_ != image.bytes) {
    decoded_.reset();
    whole_.resize(static_cast<std::size_t>(whole_row) * image.height);
    if (!decoder_.decode(raw, CameraJpegDecoder::Output::kRgb, whole_.data())) {
      problem_ = decoder_.problem();
      return false;
    }
    decoded_ = image.bytes;
  }
  const std::ptrdiff_t row = kRgb * image.columns;
  for (int y = 0; y < image.height; ++y) {
    std::memcpy(rgb + y * row, whole_.data() + y * whole_row + kRgb * image.first_column,
                static_cast<std::size_t>(row));
  }
  return true;
}

}  // namespace sovo
