#include <cctype>
#include <cstring>
#include <optional>

#include "sovo/io/image_codecs.h"

namespace sovo::codecs {
namespace {

/// Reads the header of a binary PGM or PPM: numbers between white space and comments.
class Header {
 public:
  explicit Header(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  std::optional<int> number() {
    skip_space();
    int value = 0;
    const std::size_t begin = at_;
    while (at_ < bytes_.size() && std::isdigit(bytes_[at_]) != 0 && at_ - begin < 9) {
      value = 10 * value + (bytes_[at_++] - '0');
    }
    if (at_ == begin) return std::nullopt;
    return value;
  }

  /// The pixels: one white space after the last number.
  std::span<const std::uint8_t> rest() const {
    return bytes_.subspan(std::min(at_ + 1, bytes_.size()));
  }

 private:
  void skip_space() {
    while (at_ < bytes_.size()) {
      if (bytes_[at_] == '#') {
        while (at_ < bytes_.size() && bytes_[at_] != '\n') ++at_;
      } else if (std::isspace(bytes_[at_]) != 0) {
        ++at_;
      } else {
        return;
      }
    }
  }

  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 2;
};

/// Scales to the full range and brings 16-bit values, big endian in the file, to machine order.
void copy_samples(std::span<const std::uint8_t> from, int max_value, RawPixels* to) {
  const std::uint32_t top = static_cast<std::uint32_t>(max_value);
  if (to->bits == 8) {
    for (std::size_t i = 0; i < to->data.size(); ++i) {
      const std::uint32_t v = std::min<std::uint32_t>(from[i], top);
      to->data[i] = static_cast<std::uint8_t>((v * 255U + top / 2U) / top);
    }
    return;
  }
  for (std::size_t i = 0; i + 1 < to->data.size(); i += 2) {
    const std::uint32_t v =
        std::min((static_cast<std::uint32_t>(from[i]) << 8U) | from[i + 1], top);
    const std::uint16_t scaled = static_cast<std::uint16_t>((v * 65535U + top / 2U) / top);
    std::memcpy(to->data.data() + i, &scaled, sizeof scaled);
  }
}

}  // namespace

Result<RawPixels> decode_pnm(std::span<const std::uint8_t> bytes) {
  Header header(bytes);
  const auto width = header.number();
  const auto height = header.number();
  const auto max_value = header.number();
  if (!width || !height || !max_value || *width < 1 || *height < 1 || *max_value < 1 ||
      *max_value > 65535 || std::int64_t{*width} * *height > kMaxPixels) {
    return Error{"damaged PGM header"};
  }
  RawPixels pixels{*width, *height, bytes[1] == '6' ? 3 : 1, *max_value > 255 ? 16 : 8, {}};
  const std::size_t size = static_cast<std::size_t>(*width) * *height * pixels.channels *
                           static_cast<std::size_t>(pixels.bits / 8);
  const auto samples = header.rest();
  if (samples.size() < size) return Error{"truncated PGM: pixels are missing at its end"};
  pixels.data.resize(size);
  copy_samples(samples, *max_value, &pixels);
  return pixels;
}

}  // namespace sovo::codecs
