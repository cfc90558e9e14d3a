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

/// Takes the luma out of camera images, which is all that the odometry looks at: colour is not
/// converted. Keeps a JPEG decoder and its memory.
class LumaReader {
 public:
  LumaReader();
  ~LumaReader();
  LumaReader(LumaReader&&) noexcept;
  LumaReader& operator=(LumaReader&&) noexcept;

  /// Luma of the whole image into `luma`, width * height bytes. False when the image is short,
  /// damaged, or of another size than it says; `problem()` tells.
  bool read(const RawImage& image, std::uint8_t* luma);

  /// The left and the right half of a side-by-side image, width / 2 * height bytes each.
  bool read_halves(const RawImage& image, std::uint8_t* left, std::uint8_t* right);

  const std::string& problem() const { return problem_; }

 private:
  struct Decoder;
  bool check(const RawImage& image);
  bool try_jpeg(const RawImage& image, std::uint8_t* luma);
  bool decode_jpeg(const RawImage& image, std::uint8_t* luma);

  std::unique_ptr<Decoder> decoder_;
  std::vector<std::uint8_t> scratch_;  ///< A whole JPEG's luma, to be halved.
  std::string problem_;
};

}  // namespace sovo
