#include "sovo/bridge/cdr_codec.h"

#include <algorithm>
#include <bit>

namespace sovo::bridge::cdr_detail {

static_assert(std::endian::native == std::endian::little,
              "CDR is written as numbers lie in memory");

namespace {

constexpr std::size_t kHeaderSize = 4;
constexpr char kNothing[] = "";

/// Bytes up to the next multiple of `alignment`.
std::size_t padding(std::size_t at, std::size_t alignment) {
  return (alignment - at % alignment) % alignment;
}

}  // namespace

Decoder::Decoder(CdrBytes bytes) {
  if (bytes.size() < kHeaderSize) {
    error_ = "shorter than its header";
    return;
  }
  if (bytes[0] != 0 || bytes[1] > 1) {
    error_ = "its encoding is not plain CDR";
    return;
  }
  swap_ = bytes[1] == 0;
  bytes_ = bytes.subspan(kHeaderSize);
}

void Decoder::number(void* to, std::size_t size, std::size_t count) {
  const std::size_t begin = at_ + padding(at_, size);
  if (!error_.empty() || begin > bytes_.size() || count > (bytes_.size() - begin) / size) {
    if (error_.empty()) error_ = "ends before its fields do";
    std::memset(to, 0, size * count);
    return;
  }
  std::memcpy(to, bytes_.data() + begin, size * count);
  at_ = begin + size * count;
  if (!swap_ || size == 1) return;
  auto* byte = static_cast<std::uint8_t*>(to);
  for (std::size_t i = 0; i < count; ++i, byte += size) std::reverse(byte, byte + size);
}

const char* Decoder::text() {
  const std::uint32_t size = length(1);
  if (size == 0) return kNothing;
  const auto* begin = reinterpret_cast<const char*>(bytes_.data() + at_);
  at_ += size;
  if (begin[size - 1] == '\0') return begin;
  error_ = "a text does not end";
  return kNothing;
}

std::uint32_t Decoder::length(std::size_t least_element_size) {
  std::uint32_t count = 0;
  number(&count, sizeof(count), 1);
  if (!error_.empty()) return 0;
  if (count > (bytes_.size() - at_) / least_element_size) {
    error_ = "a sequence is longer than the message";
    return 0;
  }
  return count;
}

void* Decoder::allocate(std::size_t size) {
  return memory_.emplace_back(size / sizeof(std::max_align_t) + 1).data();
}

void Encoder::number(const void* from, std::size_t size, std::size_t count) {
  bytes_.resize(bytes_.size() + padding(bytes_.size() - kHeaderSize, size));
  const auto* begin = static_cast<const std::uint8_t*>(from);
  bytes_.insert(bytes_.end(), begin, begin + size * count);
}

void Encoder::text(const char* value) {
  const char* present = value == nullptr ? kNothing : value;
  const auto size = static_cast<std::uint32_t>(std::strlen(present) + 1);
  number(&size, sizeof(size), 1);
  bytes_.insert(bytes_.end(), present, present + size);
}

}  // namespace sovo::bridge::cdr_detail
