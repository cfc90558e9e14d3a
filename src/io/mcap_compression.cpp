#include <lz4frame.h>
#include <zstd.h>

#include <memory>

#include "sovo/io/mcap_format.h"

namespace sovo::mcap {
namespace {

// Images hardly shrink at higher levels, and the odometry needs the processor.
constexpr int kZstdLevel = 1;

Bytes compress_lz4(ByteSpan bytes) {
  LZ4F_preferences_t preferences{};
  preferences.frameInfo.blockSizeID = LZ4F_max4MB;
  preferences.frameInfo.contentSize = bytes.size();
  Bytes out(LZ4F_compressFrameBound(bytes.size(), &preferences));
  const std::size_t size =
      LZ4F_compressFrame(out.data(), out.size(), bytes.data(), bytes.size(), &preferences);
  out.resize(LZ4F_isError(size) != 0U ? 0 : size);
  return out;
}

Bytes compress_zstd(ByteSpan bytes) {
  Bytes out(ZSTD_compressBound(bytes.size()));
  const std::size_t size =
      ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), kZstdLevel);
  out.resize(ZSTD_isError(size) != 0U ? 0 : size);
  return out;
}

struct Lz4Deleter {
  void operator()(LZ4F_dctx* context) const { LZ4F_freeDecompressionContext(context); }
};

/// How much was written to `out`; less than its size for a broken frame.
std::size_t decompress_lz4(ByteSpan in, Bytes* out) {
  LZ4F_dctx* raw = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION)) != 0U) return 0;
  const std::unique_ptr<LZ4F_dctx, Lz4Deleter> context(raw);
  std::size_t written = 0;
  while (!in.empty()) {
    std::size_t room = out->size() - written;
    std::size_t used = in.size();
    const std::size_t hint =
        LZ4F_decompress(context.get(), out->data() + written, &room, in.data(), &used, nullptr);
    if (LZ4F_isError(hint) != 0U || (room == 0 && used == 0)) break;
    written += room;
    in = in.subspan(used);
    if (hint == 0) break;  // the frame is complete
  }
  return written;
}

std::size_t decompress_zstd(ByteSpan in, Bytes* out) {
  const std::size_t size = ZSTD_decompress(out->data(), out->size(), in.data(), in.size());
  return ZSTD_isError(size) != 0U ? 0 : size;
}

constexpr std::uint64_t kLargestChunk = std::uint64_t{1} << 30;
// What claims to become larger than this is no chunk but an attack on memory.
constexpr std::uint64_t kLargestRatio = 4096;

}  // namespace

std::string to_chunk_name(Compression compression) {
  switch (compression) {
    case Compression::kLz4:
      return "lz4";
    case Compression::kZstd:
      return "zstd";
    case Compression::kNone:
      break;
  }
  return "";
}

Bytes compress(Compression compression, ByteSpan bytes) {
  switch (compression) {
    case Compression::kLz4:
      return compress_lz4(bytes);
    case Compression::kZstd:
      return compress_zstd(bytes);
    case Compression::kNone:
      break;
  }
  return {bytes.begin(), bytes.end()};
}

Result<Bytes> decompress(const std::string& name, ByteSpan bytes, std::uint64_t size) {
  if (size > kLargestChunk || size / kLargestRatio > bytes.size()) {
    return Error{std::to_string(bytes.size()) + " bytes cannot become " + std::to_string(size)};
  }
  if (name.empty()) {
    if (bytes.size() != size) return Error{"a chunk's size is wrong"};
    return Bytes(bytes.begin(), bytes.end());
  }
  if (name != "lz4" && name != "zstd") {
    return Error{"a chunk is compressed by '" + name + "'; known are lz4 and zstd"};
  }
  Bytes out(size);
  const std::size_t written =
      name == "lz4" ? decompress_lz4(bytes, &out) : decompress_zstd(bytes, &out);
  if (written != size) return Error{"a chunk cannot be decompressed"};
  return out;
}

}  // namespace sovo::mcap
