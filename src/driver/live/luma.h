#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace sovo {

/// What a camera's bytes mean.
enum class CameraFormat {
  kYuyv,   ///< Y0 U Y1 V
  kUyvy,   ///< U Y0 V Y1
  kGrey,   ///< 8-bit grey
  kNv12,   ///< A plane of luma, then one of colour
  kMjpeg,  ///< A JPEG a frame
};

/// Name as V4L2 spells it: "YUYV", "UYVY", "GREY", "NV12", "MJPG".
const char* to_string(CameraFormat format);

/// An image as it came from a camera.
struct RawImage {
  CameraFormat format = CameraFormat::kGrey;
  int width = 0;   ///< [px]
  int height = 0;  ///< [px]
  int stride = 0;  ///< Bytes from one row to the next (of luma, where that has a plane).
  std::span<const std::uint8_t> bytes;
};

/// Bytes that a whole image of this shape has at least; 0 where that varies (JPEG).
std::size_t expected_bytes(const RawImage& image);

/// Why an image cannot be read: no size, rows or bytes too few. Empty when it can; a JPEG is not
/// looked into.
std::string find_problem(const RawImage& image);

/// Decodes a camera's JPEGs. Keeps a decoder and its memory.
class CameraJpegDecoder {
 public:
  enum class Output { kGrey, kRgb };  ///< One byte or three a pixel.

  CameraJpegDecoder();
  ~CameraJpegDecoder();
  CameraJpegDecoder(CameraJpegDecoder&&) noexcept;
  CameraJpegDecoder& operator=(CameraJpegDecoder&&) noexcept;

  /// The whole image, rows tightly packed. False when it is damaged or of another size than it
  /// says; `problem()` tells.
  bool decode(const RawImage& image, Output output, std::uint8_t* pixels);

  const std::string& problem() const { return problem_; }

 private:
  struct Decoder;
  bool try_decode(const RawImage& image, Output output, std::uint8_t* pixels);

  std::unique_ptr<Decoder> decoder_;
  std::string problem_;
};

/// Takes the luma out of camera images, which is all that the odometry looks at: colour is not
/// converted. Keeps a JPEG decoder and its memory.
class LumaReader {
 public:
  /// Luma of the whole image into `luma`, width * height bytes. False when the image is short,
  /// damaged, or of another size than it says; `problem()` tells.
  bool read(const RawImage& image, std::uint8_t* luma);

  /// The left and the right half of a side-by-side image, width / 2 * height bytes each.
  bool read_halves(const RawImage& image, std::uint8_t* left, std::uint8_t* right);

  const std::string& problem() const { return problem_; }

 private:
  bool check(const RawImage& image);
  bool decode_jpeg(const RawImage& image, std::uint8_t* luma);

  CameraJpegDecoder decoder_;
  std::vector<std::uint8_t> scratch_;  ///< A whole JPEG's luma, to be halved.
  std::string problem_;
};

}  // namespace sovo
