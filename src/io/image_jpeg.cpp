#include <turbojpeg.h>

#include <memory>

#include "sovo/io/image_codecs.h"

namespace sovo::codecs {
namespace {

struct Destroy {
  void operator()(void* handle) const { tjDestroy(handle); }
};

}  // namespace

Result<RawPixels> decode_jpeg(std::span<const std::uint8_t> bytes) {
  const std::unique_ptr<void, Destroy> decoder(tjInitDecompress());
  if (!decoder) return Error{"the JPEG decoder cannot be started"};
  const auto size = static_cast<unsigned long>(bytes.size());
  int width = 0;
  int height = 0;
  int subsampling = 0;
  int colour_space = 0;
  const auto problem = [&] {
    return Error{std::string("damaged JPEG: ") + tjGetErrorStr2(decoder.get())};
  };
  if (tjDecompressHeader3(decoder.get(), bytes.data(), size, &width, &height, &subsampling,
                          &colour_space) != 0) {
    return problem();
  }
  if (width < 1 || height < 1 || std::int64_t{width} * height > kMaxPixels) {
    return Error{"damaged JPEG header"};
  }
  RawPixels pixels{width, height, 1, 8, {}};
  pixels.data.resize(static_cast<std::size_t>(width) * height);
  if (tjDecompress2(decoder.get(), bytes.data(), size, pixels.data.data(), width, 0, height,
                    TJPF_GRAY, TJFLAG_ACCURATEDCT) != 0) {
    return problem();
  }
  return pixels;
}

}  // namespace sovo::codecs
