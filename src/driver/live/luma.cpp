#include "sovo/driver/live/luma.h"

#include <turbojpeg.h>

#include <algorithm>
#include <cstring>
#include <utility>

namespace sovo {
namespace {

/// Luma of `count` pixels from column `x` of a row on.
void copy_row(CameraFormat format, const std::uint8_t* row, int x, int count, std::uint8_t* out) {
  if (format == CameraFormat::kGrey || format == CameraFormat::kNv12) {
    std::memcpy(out, row + x, static_cast<std::size_t>(count));
    return;
  }
  const std::uint8_t* in = row + 2 * std::ptrdiff_t{x} + (format == CameraFormat::kUyvy ? 1 : 0);
  for (int i = 0; i < count; ++i) out[i] = in[2 * i];
}

void copy_columns(const RawImage& image, int x, int count, std::uint8_t* out) {
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* row = image.bytes.data() + std::ptrdiff_t{y} * image.stride;
    copy_row(image.format, row, x, count, out + std::ptrdiff_t{y} * count);
  }
}

int bytes_per_pixel(CameraFormat format) {
  return format == CameraFormat::kYuyv || format == CameraFormat::kUyvy ? 2 : 1;
}

}  // namespace

const char* to_string(CameraFormat format) {
  switch (format) {
    case CameraFormat::kYuyv:
      return "YUYV";
    case CameraFormat::kUyvy:
      return "UYVY";
    case CameraFormat::kGrey:
      return "GREY";
    case CameraFormat::kNv12:
      return "NV12";
    case CameraFormat::kMjpeg:
      return "MJPG";
  }
  return "?";
}

std::size_t expected_bytes(const RawImage& image) {
  if (image.format == CameraFormat::kMjpeg || image.height <= 0) return 0;
  // The last row need not be padded.
  const auto row = static_cast<std::size_t>(image.width) * bytes_per_pixel(image.format);
  const auto luma = static_cast<std::size_t>(image.stride) * (image.height - 1) + row;
  if (image.format != CameraFormat::kNv12) return luma;
  return static_cast<std::size_t>(image.stride) * (image.height + image.height / 2 - 1) + row;
}

std::string find_problem(const RawImage& image) {
  if (image.width < 2 || image.height < 1) return "the image has no size";
  if (image.format == CameraFormat::kMjpeg) return "";
  if (image.stride < image.width * bytes_per_pixel(image.format)) {
    return "rows of " + std::to_string(image.stride) + " bytes are too short for " +
           std::to_string(image.width) + " pixels " + to_string(image.format);
  }
  if (image.bytes.size() < expected_bytes(image)) {
    return std::to_string(image.bytes.size()) + " bytes came, " +
           std::to_string(expected_bytes(image)) + " make an image";
  }
  return "";
}

struct CameraJpegDecoder::Decoder {
  Decoder() : handle(tjInitDecompress()) {}
  ~Decoder() {
    if (handle != nullptr) tjDestroy(handle);
  }
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;

  tjhandle handle;
};

CameraJpegDecoder::CameraJpegDecoder() = default;
CameraJpegDecoder::~CameraJpegDecoder() = default;
CameraJpegDecoder::CameraJpegDecoder(CameraJpegDecoder&&) noexcept = default;
CameraJpegDecoder& CameraJpegDecoder::operator=(CameraJpegDecoder&&) noexcept = default;

bool CameraJpegDecoder::decode(const RawImage& image, Output output, std::uint8_t* pixels) {
  if (try_decode(image, output, pixels)) return true;
  // A decoder that met damaged data goes on to refuse good data.
  decoder_.reset();
  return false;
}

bool CameraJpegDecoder::try_decode(const RawImage& image, Output output, std::uint8_t* pixels) {
  if (!decoder_) decoder_ = std::make_unique<Decoder>();
  const auto size = static_cast<unsigned long>(image.bytes.size());
  int width = 0;
  int height = 0;
  int subsampling = 0;
  int colour_space = 0;
  if (decoder_->handle == nullptr ||
      tjDecompressHeader3(decoder_->handle, image.bytes.data(), size, &width, &height, &subsampling,
                          &colour_space) != 0) {
    problem_ = "damaged JPEG";
    return false;
  }
  if (width != image.width || height != image.height) {
    problem_ = "a JPEG of " + std::to_string(width) + "x" + std::to_string(height) + " came";
    return false;
  }
  // Warnings are data that ended early or made no sense: the lower part of the image is grey.
  if (tjDecompress2(decoder_->handle, image.bytes.data(), size, pixels, width, 0, height,
                    output == Output::kRgb ? TJPF_RGB : TJPF_GRAY, TJFLAG_STOPONWARNING) != 0) {
    problem_ = std::string("damaged JPEG: ") + tjGetErrorStr2(decoder_->handle);
    return false;
  }
  return true;
}

bool LumaReader::check(const RawImage& image) {
  std::string problem = find_problem(image);
  if (problem.empty()) return true;
  problem_ = std::move(problem);
  return false;
}

bool LumaReader::decode_jpeg(const RawImage& image, std::uint8_t* luma) {
  if (decoder_.decode(image, CameraJpegDecoder::Output::kGrey, luma)) return true;
  problem_ = decoder_.problem();
  return false;
}

bool LumaReader::read(const RawImage& image, std::uint8_t* luma) {
  if (!check(image)) return false;
  if (image.format == CameraFormat::kMjpeg) return decode_jpeg(image, luma);
  copy_columns(image, 0, image.width, luma);
  return true;
}

bool LumaReader::read_halves(const RawImage& image, std::uint8_t* left, std::uint8_t* right) {
  if (!check(image)) return false;
  RawImage grey = image;
  if (image.format == CameraFormat::kMjpeg) {
    scratch_.resize(static_cast<std::size_t>(image.width) * image.height);
    if (!decode_jpeg(image, scratch_.data())) return false;
    grey = {CameraFormat::kGrey, image.width, image.height, image.width, scratch_};
  }
  const int half = image.width / 2;
  copy_columns(grey, 0, half, left);
  copy_columns(grey, half, half, right);
  return true;
}

}  // namespace sovo
