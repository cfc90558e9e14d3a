#include "sovo/bridge/recorder_config.h"

#include <tuple>

#include "sovo/io/size.h"
#include "sovo/io/text.h"

namespace sovo::bridge {

Result<RecorderSizes> read_sizes(const RecorderConfig& config) {
  RecorderSizes sizes;
  sizes.file.compression = config.compression;
  const std::tuple<const char*, const std::string&, std::uint64_t*> keys[] = {
      {"split", config.split, &sizes.file.split_bytes},
      {"min_free", config.min_free, &sizes.file.min_free_bytes},
      {"chunk", config.chunk, &sizes.file.chunk_bytes},
      {"queue", config.queue, &sizes.queue_bytes}};
  for (const auto& [key, text, bytes] : keys) {
    const auto size = parse_size(text);
    if (!size) {
      return Error{std::string("record.") + key + " is '" + excerpt(text) +
                   "'; it must be a size as 500MB or 2GB"};
    }
    *bytes = *size;
  }
  return sizes;
}

}  // namespace sovo::bridge
