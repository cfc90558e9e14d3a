#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sovo/driver/live/image_pool.h"
#include "sovo/driver/live/luma.h"

namespace sovo {

/// One side of a camera's image as the camera gave it, with its colours not decoded yet. Cheap to
/// copy: the bytes are shared, and never changed after they were filled.
struct ColourImage {
  CameraFormat format = CameraFormat::kGrey;
  int width = 0;   ///< Of the camera's image [px], both sides of a side-by-side one.
  int height = 0;  ///< [px]
  int stride = 0;  ///< Bytes from one row to the next.
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;  ///< Null: there is no colour.
  int first_column = 0;                                    ///< Of this side.
  int columns = 0;                                         ///< Of this side.

  /// The left or the right half, of a side-by-side image.
  ColourImage half(bool right) const;
};

/// Both sides of a frame.
struct StereoColour {
  ColourImage left;
  ColourImage right;
};

/// Set while somebody wants colour: by whoever shows it, read by the threads that capture.
using ColourWanted = std::shared_ptr<std::atomic<bool>>;

/// Keeps the bytes of one camera's images beside their luma, while somebody wants colour. Until
/// then it holds no memory and does nothing, and it never waits: images that come while all its
/// buffers are in use are not kept, and counted. For one thread; images may be given up on any.
class ColourKeeper {
 public:
  /// `wanted`: null when nobody ever will.
  explicit ColourKeeper(ColourWanted wanted) : wanted_(std::move(wanted)) {}

  /// A copy of a good image's bytes; without bytes when nobody wants it, or it is grey.
  ColourImage keep(const RawImage& image);

  std::uint64_t kept() const { return kept_; }
  std::uint64_t skipped() const { return skipped_; }

 private:
  ColourWanted wanted_;
  std::optional<ImagePool> pool_;  ///< While colour is wanted.
  std::uint64_t kept_ = 0;
  std::uint64_t skipped_ = 0;
};

/// Decodes colours: BT.601 at full range, as JPEG has it, so that the luma of what comes out is the
/// luma that LumaReader takes out of the same image. Keeps a JPEG decoder and its memory.
class ColourReader {
 public:
  /// `columns` * `height` pixels of red, green and blue. False when the image is without colour,
  /// short, damaged, or of another size than it says; `problem()` tells. The two halves of a JPEG
  /// cost one decoding when they are read one after the other.
  bool read(const ColourImage& image, std::vector<std::uint8_t>* rgb);

  const std::string& problem() const { return problem_; }

 private:
  bool check(const ColourImage& image, const RawImage& raw);
  bool read_jpeg(const ColourImage& image, const RawImage& raw, std::uint8_t* rgb);

  CameraJpegDecoder decoder_;
  std::shared_ptr<const std::vector<std::uint8_t>> decoded_;  ///< The JPEG in `whole_`, or null.
  std::vector<std::uint8_t> whole_;
  std::string problem_;
};

}  // namespace sovo
