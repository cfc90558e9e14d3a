#include "sovo/io/size.h"

#include <utility>

#include "sovo/io/text.h"

namespace sovo {

std::optional<std::uint64_t> parse_size(std::string_view text) {
  constexpr std::pair<std::string_view, double> kUnits[] = {{"kB", 1e3}, {"KB", 1e3},  {"MB", 1e6},
                                                            {"GB", 1e9}, {"TB", 1e12}, {"B", 1.0}};
  std::string_view number = trim(text);
  double factor = 1.0;
  for (const auto& [unit, bytes] : kUnits) {
    if (!number.ends_with(unit)) continue;
    number = trim(number.substr(0, number.size() - unit.size()));
    factor = bytes;
    break;
  }
  const auto value = parse_double(number);
  constexpr double kLargest = 1e18;
  if (!value || *value < 0.0 || *value * factor > kLargest) return std::nullopt;
  return static_cast<std::uint64_t>(*value * factor);
}

}  // namespace sovo
