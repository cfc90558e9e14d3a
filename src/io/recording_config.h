#pragma once

#include <array>
#include <cstdint>
#include <utility>

namespace sovo {

namespace mcap {

/// How a chunk is packed.
enum class Compression : std::uint8_t { kNone, kLz4, kZstd };

constexpr std::array<std::pair<Compression, const char*>, 3> enum_names(Compression) {
  return {{{Compression::kNone, "none"}, {Compression::kLz4, "lz4"}, {Compression::kZstd, "zstd"}}};
}

}  // namespace mcap

/// How a recording is written.
struct RecordingConfig {
  mcap::Compression compression = mcap::Compression::kLz4;
  std::uint64_t chunk_bytes = 4'000'000;  ///< A chunk is closed beyond this, and after a second.
  std::uint64_t split_bytes = 0;          ///< A file is followed by another beyond this; 0: never.
  std::uint64_t min_free_bytes = 1'000'000'000;  ///< Recording ends when the disk has less left.
};

}  // namespace sovo
