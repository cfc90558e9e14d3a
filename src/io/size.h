#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace sovo {

/// Size in bytes: a number with B, kB, MB, GB or TB (powers of ten), or with nothing for bytes.
std::optional<std::uint64_t> parse_size(std::string_view text);

}  // namespace sovo
