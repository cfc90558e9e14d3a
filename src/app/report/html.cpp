#include "sovo/app/report/html.h"

#include <cstdint>

namespace sovo::app {
namespace {

constexpr char kReplacement[] = "\xEF\xBF\xBD";

/// Bytes of the UTF-8 character that `text` begins with; 0 when there is none.
std::size_t character_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const std::uint8_t first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4 || text.size() < length) return 0;
  std::uint32_t code = first & (0xFFU >> (length + 1));
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0U) != 0x80U) return 0;
    code = (code << 6U) | (byte(i) & 0x3FU);
  }
  const bool is_overlong = (length == 3 && code < 0x800) || (length == 4 && code < 0x10000);
  const bool is_no_character = (code >= 0xD800 && code <= 0xDFFF) || code > 0x10FFFF;
  // Controls of the upper half, and those that turn the direction of writing.
  const bool is_control = (code >= 0x80 && code < 0xA0) || (code >= 0x202A && code <= 0x202E) ||
                          (code >= 0x2066 && code <= 0x2069);
  return is_overlong || is_no_character || is_control ? 0 : length;
}

void append_escaped(std::string_view character, std::string* out) {
  switch (character.front()) {
    case '&':
      *out += "&amp;";
      return;
    case '<':
      *out += "&lt;";
      return;
    case '>':
      *out += "&gt;";
      return;
    case '"':
      *out += "&quot;";
      return;
    case '\'':
      *out += "&#39;";
      return;
    default:
      break;
  }
  const auto byte = static_cast<std::uint8_t>(character.front());
  if (byte < 0x20 || byte == 0x7F) {
    *out += byte == '\n' || byte == '\t' ? " " : kReplacement;
  } else {
    *out += character;
  }
}

}  // namespace

std::string escape_html(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const std::size_t length = character_length(text);
    if (length == 0) {
      out += kReplacement;
      text.remove_prefix(1);
      continue;
    }
    append_escaped(text.substr(0, length), &out);
    text.remove_prefix(length);
  }
  return out;
}

std::string format_html(const HtmlTable& table) {
  const auto cell = [&](const char* tag, std::size_t column, const std::string& text) {
    return std::string("<") + tag + (column < table.text_columns ? ">" : " class=\"num\">") +
           escape_html(text) + "</" + tag + ">";
  };
  std::string out = "<div class=\"wide\"><table id=\"" + escape_html(table.id) + "\"><thead><tr>";
  for (std::size_t i = 0; i < table.head.size(); ++i) out += cell("th", i, table.head[i]);
  out += "</tr></thead>\n<tbody>";
  for (const auto& row : table.rows) {
    out += "<tr>";
    for (std::size_t i = 0; i < row.size(); ++i) out += cell("td", i, row[i]);
    out += "</tr>\n";
  }
  return out + "</tbody></table></div>\n";
}

}  // namespace sovo::app
