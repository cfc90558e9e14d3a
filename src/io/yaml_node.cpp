#include "sovo/io/yaml_node.h"

namespace sovo {

Result<YAML::Node> parse_yaml(const std::string& text, const std::string& name) {
  try {
    // Bytes that YAML does not allow, rather than whatever the parser makes of them.
    for (const char c : text) {
      const auto byte = static_cast<unsigned char>(c);
      if (byte < 0x20 && c != '\n' && c != '\r' && c != '\t') {
        return Error{name + ": is not YAML: it has unprintable bytes"};
      }
    }
    const std::vector<YAML::Node> documents = YAML::LoadAll(text);
    if (documents.size() > 1) return Error{name + ": more than one YAML document"};
    return documents.empty() ? YAML::Node() : documents.front();
  } catch (const YAML::Exception& error) {
    const std::string line = error.mark.is_null() ? "" : std::to_string(error.mark.line + 1) + ":";
    return Error{name + ":" + line + " is not YAML: " + error.msg};
  }
}

std::string at_line(const std::string& name, const YAML::Node& node) {
  const YAML::Mark mark = node.Mark();
  return mark.is_null() ? name + ": " : name + ":" + std::to_string(mark.line + 1) + ": ";
}

bool is_plain_scalar(const YAML::Node& node) { return node.IsScalar() && node.Tag() != "!"; }

}  // namespace sovo
