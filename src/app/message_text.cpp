#include "sovo/app/message_text.h"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace sovo::app {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostElements = 16;

std::string scalar_text(const Json& value) {
  return value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

void append(const Json& value, const std::string& indent, std::string* text);

void append_array(const Json& array, const std::string& indent, std::string* text) {
  const std::size_t shown = std::min(array.size(), kMostElements);
  const bool flat = array.empty() || !array.front().is_structured();
  std::string line;
  for (std::size_t i = 0; i < shown; ++i) {
    if (flat) {
      line += (i == 0 ? "" : ", ") + scalar_text(array[i]);
    } else {
      *text += "\n" + indent + "- " + std::to_string(i);
      append(array[i], indent + "  ", text);
    }
  }
  const std::string more =
      shown < array.size() ? "... " + std::to_string(array.size()) + " in all" : "";
  if (flat) {
    *text += " [" + line + (more.empty() ? "" : ", " + more) + "]";
  } else if (!more.empty()) {
    *text += "\n" + indent + more;
  }
}

void append(const Json& value, const std::string& indent, std::string* text) {
  if (value.is_object()) {
    for (const auto& [name, field] : value.items()) {
      *text += "\n" + indent + name + ":";
      append(field, indent + "  ", text);
    }
  } else if (value.is_array()) {
    append_array(value, indent, text);
  } else {
    *text += " " + scalar_text(value);
  }
}

}  // namespace

std::string message_text(const nlohmann::ordered_json& message) {
  std::string text;
  append(message, "", &text);
  return text.empty() ? text : text.substr(1);
}

}  // namespace sovo::app
