#include "sovo/io/image_file.h"

#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>
#include <utility>

#include "sovo/io/image_codecs.h"

namespace sovo {
namespace {

using codecs::RawPixels;

static_assert(std::endian::native == std::endian::little, "Mono16 is little endian");

bool starts_with(std::span<const std::uint8_t> bytes, std::string_view magic) {
  return bytes.size() >= magic.size() && std::memcmp(bytes.data(), magic.data(), magic.size()) == 0;
}

/// Rec. 601 luma in fixed point (14 bits), rounded.
template <class T>
void luma(const RawPixels& rgb, std::vector<std::uint8_t>* out) {
  const std::size_t count = static_cast<std::size_t>(rgb.width) * rgb.height;
  out->resize(count * sizeof(T));
  for (std::size_t i = 0; i < count; ++i) {
    std::array<T, 3> c;
    std::memcpy(c.data(), rgb.data.data() + 3 * sizeof(T) * i, sizeof c);
    const std::uint32_t sum = 4899U * c[0] + 9617U * c[1] + 1868U * c[2] + 8192U;
    const T grey = static_cast<T>(sum >> 14U);
    std::memcpy(out->data() + sizeof(T) * i, &grey, sizeof grey);
  }
}

GreyImage to_grey(RawPixels pixels) {
  GreyImage image;
  image.width = pixels.width;
  image.height = pixels.height;
  image.format = pixels.bits == 16 ? PixelFormat::kMono16 : PixelFormat::kMono8;
  if (pixels.channels == 1) {
    image.data = std::move(pixels.data);
  } else if (pixels.bits == 16) {
    luma<std::uint16_t>(pixels, &image.data);
  } else {
    luma<std::uint8_t>(pixels, &image.data);
  }
  return image;
}

Result<std::vector<std::uint8_t>> read_bytes(const std::string& path) {
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  if (!in) return Error{std::string("cannot be opened: ") + std::strerror(errno)};
  const std::streamoff size = in.tellg();
  constexpr std::streamoff kMaxBytes = std::streamoff{1} << 30;
  if (size < 0 || size > kMaxBytes) return Error{"is not an image file"};
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(size));
  in.seekg(0);
  in.read(reinterpret_cast<char*>(bytes.data()), size);
  if (in.gcount() != size) return Error{"cannot be read to its end"};
  return bytes;
}

}  // namespace

Result<GreyImage> decode_grey_image(std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return Error{"the file is empty"};
  Result<RawPixels> pixels = Error{"not a PNG, JPEG, PGM or PPM image"};
  if (starts_with(bytes, "\x89PNG")) {
    pixels = codecs::decode_png(bytes);
  } else if (starts_with(bytes, "\xff\xd8")) {
    pixels = codecs::decode_jpeg(bytes);
  } else if (starts_with(bytes, "P5") || starts_with(bytes, "P6")) {
    pixels = codecs::decode_pnm(bytes);
  }
  if (!pixels) return pixels.failure();
  return to_grey(std::move(*pixels));
}

Result<GreyImage> read_grey_image(const std::string& path) {
  const auto bytes = read_bytes(path);
  if (!bytes) return Error{path + ": " + bytes.error()};
  auto image = decode_grey_image(*bytes);
  if (!image) return Error{path + ": " + image.error()};
  return image;
}

SideImage to_side(GreyImage image) {
  SideImage side;
  side.valid = true;
  side.width = image.width;
  side.height = image.height;
  side.format = image.format;
  side.step = image.step();
  side.data = std::make_shared<const std::vector<std::uint8_t>>(std::move(image.data));
  return side;
}

Result<void> write_png(const std::string& path, const GreyImage& image) {
  const auto bytes = codecs::encode_png(image);
  if (!bytes) return Error{path + ": " + bytes.error()};
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  if (!out) return Error{path + ": cannot be written: " + std::strerror(errno)};
  out.write(reinterpret_cast<const char*>(bytes->data()),
            static_cast<std::streamsize>(bytes->size()));
  out.flush();
  if (!out) return Error{path + ": writing failed: " + std::strerror(errno)};
  return {};
}

}  // namespace sovo
