#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace sovo::app {

/// Text that stays text between tags and in quoted attributes, whoever wrote it: markup is
/// escaped, control characters and bytes that are not UTF-8 become U+FFFD.
std::string escape_html(std::string_view text);

/// A table; all cells are escaped.
struct HtmlTable {
  std::string id;
  std::vector<std::string> head;
  std::vector<std::vector<std::string>> rows;
  std::size_t text_columns = 1;  ///< As many columns from the left are text, the others numbers.
};

std::string format_html(const HtmlTable& table);

}  // namespace sovo::app
