#include "sovo/io/text.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>

namespace sovo {
namespace {

constexpr std::uintmax_t kMaxFileBytes = 256U << 20U;
constexpr std::string_view kSpace = " \t\r\n\v\f";

/// A decimal number taken apart: value = sign * digits * 10^exponent.
struct Decimal {
  bool negative = false;
  std::string digits;
  int exponent = 0;
};

std::optional<Decimal> parse_decimal(std::string_view text) {
  Decimal result;
  std::size_t i = 0;
  if (i < text.size() && (text[i] == '-' || text[i] == '+')) result.negative = text[i++] == '-';
  bool in_fraction = false;
  for (; i < text.size() && text[i] != 'e' && text[i] != 'E'; ++i) {
    if (text[i] == '.' && !in_fraction) {
      in_fraction = true;
    } else if (text[i] >= '0' && text[i] <= '9' && result.digits.size() < 60) {
      result.digits += text[i];
      if (in_fraction) --result.exponent;
    } else {
      return std::nullopt;
    }
  }
  if (result.digits.empty()) return std::nullopt;
  if (i < text.size()) {
    const auto exponent = parse_integer(text.substr(i + 1));
    if (!exponent || std::abs(*exponent) > 100) return std::nullopt;
    result.exponent += static_cast<int>(*exponent);
  }
  return result;
}

template <class T>
std::string shortest(T value) {
  std::array<char, 64> buffer{};
  const auto result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return {buffer.data(), result.ptr};
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substituted});
    }
  }
  return row.back();
}

}  // namespace

Result<std::string> read_text_file(const std::string& path) {
  std::error_code code;
  if (std::filesystem::is_directory(path, code)) {
    return Error{path + ": is a folder, a file is needed"};
  }
  const auto size = std::filesystem::file_size(path, code);
  if (code) return Error{path + ": cannot be read: " + code.message()};
  if (size > kMaxFileBytes) return Error{path + ": too large to be a text file"};
  std::ifstream in(path, std::ios::binary);
  if (!in) return Error{path + ": cannot be opened: " + std::strerror(errno)};
  std::string text(size, '\0');
  in.read(text.data(), static_cast<std::streamsize>(size));
  text.resize(static_cast<std::size_t>(in.gcount()));
  return text;
}

Result<void> write_text_file(const std::string& path, const std::string& text) {
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  if (!out) return Error{path + ": cannot be written: " + std::strerror(errno)};
  out.write(text.data(), static_cast<std::streamsize>(text.size()));
  out.flush();
  if (!out) return Error{path + ": writing failed: " + std::strerror(errno)};
  return {};
}

std::optional<double> parse_double(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-' && text[1] != '+') text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || end != text.data() + text.size()) return std::nullopt;
  if (error == std::errc::result_out_of_range) {
    // A number too small for a double is zero, one too large is not a number we can use.
    const auto decimal = parse_decimal(text);
    if (text.find("e-") == text.npos && text.find("E-") == text.npos) return std::nullopt;
    return decimal && decimal->negative ? -0.0 : 0.0;
  }
  if (error != std::errc() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<std::int64_t> parse_integer(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || end != text.data() + text.size() || error != std::errc()) return std::nullopt;
  return value;
}

std::optional<std::int64_t> parse_seconds_as_ns(std::string_view text) {
  auto decimal = parse_decimal(text);
  if (!decimal) return std::nullopt;
  int exponent = decimal->exponent + 9;
  std::string& digits = decimal->digits;
  if (exponent > 0) digits.append(static_cast<std::size_t>(exponent), '0');
  bool round_up = false;
  if (exponent < 0) {
    const auto cut = static_cast<std::size_t>(-exponent);
    if (cut > digits.size()) return 0;
    round_up = digits[digits.size() - cut] >= '5';
    digits.resize(digits.size() - cut);
  }
  digits.insert(digits.begin(), '0');
  const auto value = parse_integer(digits);
  if (!value || *value == std::numeric_limits<std::int64_t>::max()) return std::nullopt;
  const std::int64_t magnitude = *value + (round_up ? 1 : 0);
  return decimal->negative ? -magnitude : magnitude;
}

std::string format_ns_as_seconds(std::int64_t ns) {
  // The magnitude of the smallest int64 fits only an unsigned number.
  const auto magnitude =
      ns < 0 ? ~static_cast<std::uint64_t>(ns) + 1U : static_cast<std::uint64_t>(ns);
  const std::string fraction = std::to_string(magnitude % 1000000000U);
  return (ns < 0 ? "-" : "") + std::to_string(magnitude / 1000000000U) + "." +
         std::string(9 - fraction.size(), '0') + fraction;
}

std::string format_double(double value) { return shortest(value); }

std::string format_float(float value) { return shortest(value); }

std::string format_fixed(double value, int decimals) {
  std::array<char, 512> buffer{};
  const auto result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                    std::chars_format::fixed, decimals);
  return {buffer.data(), result.ptr};
}

std::vector<std::string_view> split(std::string_view line, std::string_view separators) {
  std::vector<std::string_view> pieces;
  std::size_t begin = line.find_first_not_of(separators);
  while (begin != std::string_view::npos) {
    const std::size_t end = std::min(line.find_first_of(separators, begin), line.size());
    pieces.push_back(line.substr(begin, end - begin));
    begin = line.find_first_not_of(separators, end);
  }
  return pieces;
}

std::vector<std::string_view> split_lines(std::string_view text) {
  std::vector<std::string_view> lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    lines.push_back(line);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

std::string_view trim(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(kSpace);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kSpace) - begin + 1);
}

std::string excerpt(std::string_view text) {
  std::string out(text.substr(0, 60));
  for (char& c : out) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte >= 0x7f) c = '?';
  }
  return text.size() > 60 ? out + "..." : out;
}

std::string nearest_word(std::string_view word, const std::vector<std::string>& known) {
  if (word.size() > 200) return {};
  std::size_t best = std::max<std::size_t>(1, word.size() / 3) + 1;
  std::string nearest;
  for (const std::string& candidate : known) {
    const std::size_t distance = edit_distance(word, candidate);
    if (distance < best) {
      best = distance;
      nearest = candidate;
    }
  }
  return nearest;
}

}  // namespace sovo
