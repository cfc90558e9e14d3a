#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sovo/io/result.h"

namespace sovo {

/// The content of a text file of at most 256 MB; the error names the file and the reason.
Result<std::string> read_text_file(const std::string& path);

/// Writes a text file as a whole; the error names the file and the reason.
Result<void> write_text_file(const std::string& path, const std::string& text);

/// Number in the C locale, all of `text` ("+" allowed, no spaces); nothing when it is not one, or
/// is not finite.
std::optional<double> parse_double(std::string_view text);

/// Whole number, all of `text`.
std::optional<std::int64_t> parse_integer(std::string_view text);

/// Decimal seconds ("1403636584.763555584", "1.036170e-01") as nanoseconds, without going through
/// floating point: nothing is lost; digits beyond the ninth decimal are rounded.
std::optional<std::int64_t> parse_seconds_as_ns(std::string_view text);

/// Nanoseconds as decimal seconds with nine decimals.
std::string format_ns_as_seconds(std::int64_t ns);

/// Shortest text that reads back as the same number.
std::string format_double(double value);
std::string format_float(float value);

/// `value` with a fixed number of decimals, in the C locale.
std::string format_fixed(double value, int decimals);

/// Pieces of `line` between any of `separators`, empty pieces left out.
std::vector<std::string_view> split(std::string_view line, std::string_view separators);

/// Lines without their ends ("\n" or "\r\n").
std::vector<std::string_view> split_lines(std::string_view text);

/// `text` without white space at both ends.
std::string_view trim(std::string_view text);

/// `text` short and printable enough for a message.
std::string excerpt(std::string_view text);

/// The one of `known` that `word` is most likely a slip of; empty when none is near.
std::string nearest_word(std::string_view word, const std::vector<std::string>& known);

}  // namespace sovo
