#include "sovo/eval/keyframe_file.h"

#include <algorithm>
#include <array>
#include <limits>

#include "sovo/io/text.h"

namespace sovo {
namespace {

constexpr std::array<const char*, 4> kColumns{"stamp", "correction", "sigma", "verdict"};

/// Where each of kColumns stands.
using ColumnOrder = std::array<std::size_t, kColumns.size()>;

std::optional<std::int64_t> parse_stamp(std::string_view text) {
  const auto whole = parse_integer(text);
  constexpr std::int64_t kLeastNanoseconds = 1'000'000'000'000;
  if (whole && *whole >= kLeastNanoseconds) return whole;
  return parse_seconds_as_ns(text);
}

Result<ColumnOrder> parse_header(const std::string& path, std::string_view line) {
  const auto fields = split(line, ", \t");
  ColumnOrder order{};
  for (std::size_t i = 0; i < kColumns.size(); ++i) {
    const auto found = std::find(fields.begin(), fields.end(), kColumns[i]);
    if (found == fields.end()) {
      return Error{path + ":1: no column '" + kColumns[i] +
                   "'; the first line must be stamp,correction,sigma,verdict"};
    }
    order[i] = static_cast<std::size_t>(found - fields.begin());
  }
  return order;
}

/// A number; "nan" and "inf" are what keyframes without a measurement have.
std::optional<double> parse_measure(std::string_view text) {
  if (text == "nan" || text == "-nan") return std::numeric_limits<double>::quiet_NaN();
  if (text == "inf") return std::numeric_limits<double>::infinity();
  return parse_double(text);
}

}  // namespace

Result<std::vector<KeyframeRecord>> read_keyframes(const std::string& path) {
  const auto text = read_text_file(path);
  if (!text) return text.failure();
  const auto lines = split_lines(*text);
  if (lines.empty()) return Error{path + ": is empty"};
  const auto order = parse_header(path, lines[0]);
  if (!order) return order.failure();
  std::vector<KeyframeRecord> records;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const auto fields = split(lines[i], ", \t");
    if (fields.empty()) continue;
    const std::string where = path + ":" + std::to_string(i + 1) + ": ";
    if (fields.size() < kColumns.size()) return Error{where + "four columns are needed"};
    const auto stamp = parse_stamp(fields[(*order)[0]]);
    const auto correction = parse_measure(fields[(*order)[1]]);
    const auto sigma = parse_measure(fields[(*order)[2]]);
    if (!stamp) return Error{where + "stamp must be a number of seconds"};
    if (!correction || !sigma) return Error{where + "correction and sigma must be numbers"};
    records.push_back({*stamp, *correction, *sigma, std::string(fields[(*order)[3]])});
  }
  return records;
}

}  // namespace sovo
