#include "sovo/io/yaml_config.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <set>

#include "sovo/io/text.h"
#include "sovo/io/yaml_node.h"

namespace sovo {
namespace {

template <class... Ts>
struct Overloaded : Ts... {
  using Ts::operator()...;
};
template <class... Ts>
Overloaded(Ts...) -> Overloaded<Ts...>;

std::string join(const std::vector<std::string>& words, const std::string& separator) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : separator) + word;
  return text;
}

template <class T>
bool set_whole(const YAML::Node& node, T* target) {
  if (!is_plain_scalar(node)) return false;
  if constexpr (std::is_unsigned_v<T>) {
    const auto value = parse_integer(node.Scalar());
    if (!value || *value < 0) return false;
    *target = static_cast<T>(*value);
  } else {
    const auto value = parse_integer(node.Scalar());
    if (!value || *value < std::numeric_limits<T>::min() ||
        *value > std::numeric_limits<T>::max()) {
      return false;
    }
    *target = static_cast<T>(*value);
  }
  return true;
}

bool set_value(const YAML::Node& node, int* target) { return set_whole(node, target); }
bool set_value(const YAML::Node& node, std::int64_t* target) { return set_whole(node, target); }
bool set_value(const YAML::Node& node, std::uint64_t* target) { return set_whole(node, target); }

bool set_value(const YAML::Node& node, bool* target) {
  if (!is_plain_scalar(node)) return false;
  if (node.Scalar() != "true" && node.Scalar() != "false") return false;
  *target = node.Scalar() == "true";
  return true;
}

bool set_value(const YAML::Node& node, double* target) {
  if (!is_plain_scalar(node)) return false;
  const auto value = parse_double(node.Scalar());
  if (value) *target = *value;
  return value.has_value();
}

bool set_value(const YAML::Node& node, float* target) {
  double value = 0.0;
  if (!set_value(node, &value)) return false;
  if (std::abs(value) > static_cast<double>(std::numeric_limits<float>::max())) return false;
  *target = static_cast<float>(value);
  return true;
}

bool set_value(const YAML::Node& node, std::string* target) {
  if (!node.IsScalar()) return false;
  *target = node.Scalar();
  return true;
}

template <class T>
bool set_value(const YAML::Node& node, std::vector<T>* target) {
  if (!node.IsSequence()) return false;
  std::vector<T> values;
  for (const YAML::Node& element : node) {
    if (!set_value(element, &values.emplace_back())) return false;
  }
  *target = std::move(values);
  return true;
}

bool set_value(const YAML::Node& node, const EnumField& target) {
  if (!node.IsScalar()) return false;
  const auto it = std::find(target.names.begin(), target.names.end(), node.Scalar());
  if (it == target.names.end()) return false;
  target.set(static_cast<std::size_t>(it - target.names.begin()));
  return true;
}

std::string quoted(const std::string& text) {
  static constexpr char kHex[] = "0123456789abcdef";
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += {'\\', c};
    } else if (byte < 0x20 || byte == 0x7f) {
      out += {'\\', 'x', kHex[byte >> 4U], kHex[byte & 15U]};
    } else {
      out += c;
    }
  }
  return out + "\"";
}

std::string value_text(bool value) { return value ? "true" : "false"; }
std::string value_text(int value) { return std::to_string(value); }
std::string value_text(std::int64_t value) { return std::to_string(value); }
std::string value_text(std::uint64_t value) { return std::to_string(value); }
std::string value_text(float value) { return format_float(value); }
std::string value_text(double value) { return format_double(value); }
std::string value_text(const std::string& value) { return quoted(value); }

template <class T>
std::string value_text(const std::vector<T>& values) {
  std::vector<std::string> texts;
  for (const T& value : values) texts.push_back(value_text(value));
  return "[" + join(texts, ", ") + "]";
}

/// Sets the field; the error says what was expected.
Result<void> set_field(const ConfigField& field, const YAML::Node& node) {
  const bool done = std::visit(Overloaded{[](const SectionField&) { return false; },
                                          [&](const auto& to) { return set_value(node, to); }},
                               field.target);
  if (done) return {};
  std::string message = "'" + field.path + "' must be " + field_kind(field);
  if (node.IsScalar()) message += ", not '" + excerpt(node.Scalar()) + "'";
  if (const auto* choice = std::get_if<EnumField>(&field.target); choice && node.IsScalar()) {
    const std::string nearest = nearest_word(node.Scalar(), choice->names);
    if (!nearest.empty()) message += "; did you mean '" + nearest + "'?";
  }
  return Error{message};
}

/// Reads one YAML document into fields, collecting everything that is wrong with it.
class Loader {
 public:
  Loader(const std::string& name, const std::vector<ConfigField>& fields)
      : name_(name), fields_(fields) {}

  void load_section(const YAML::Node& node, const std::string& section) {
    if (node.IsNull()) return;
    if (!node.IsMap()) {
      complain(node, section.empty() ? std::string("a list of 'key: value' lines is needed")
                                     : "'" + section + "' is a section: keys go below it");
      return;
    }
    std::set<std::string> seen;
    for (const auto& entry : node) {
      const YAML::Node& key_node = entry.first;
      const YAML::Node& value = entry.second;
      const std::string key = key_node.IsScalar() ? key_node.Scalar() : "?";
      const std::string path = section.empty() ? key : section + "." + key;
      if (!seen.insert(key).second) {
        complain(key_node, "'" + excerpt(path) + "' is given twice");
        continue;
      }
      const ConfigField* field = find(path);
      if (field == nullptr) {
        complain(key_node, unknown_key(key, section));
      } else if (field->is_section()) {
        load_section(value, path);
      } else if (const auto result = set_field(*field, value); !result) {
        complain(key_node, result.error());
      }
    }
  }

  void complain(const YAML::Node& node, const std::string& what) {
    problems_.push_back(at_line(name_, node) + what);
  }

  const ConfigField* find(const std::string& path) const {
    const auto it = std::find_if(fields_.begin(), fields_.end(),
                                 [&](const ConfigField& field) { return field.path == path; });
    return it == fields_.end() ? nullptr : &*it;
  }

  /// What to say about a key that the section does not have.
  std::string unknown_key(const std::string& key, const std::string& section) const {
    std::string message = "unknown key '" + excerpt(key) + "'";
    if (!section.empty()) message += " in section '" + section + "'";
    const std::string prefix = section.empty() ? "" : section + ".";
    std::vector<std::string> siblings;
    std::string elsewhere;
    for (const ConfigField& field : fields_) {
      const std::size_t dot = field.path.rfind('.');
      const std::string leaf = dot == std::string::npos ? field.path : field.path.substr(dot + 1);
      if (field.path == prefix + leaf) siblings.push_back(leaf);
      if (leaf == key) elsewhere = field.path;
    }
    if (!elsewhere.empty()) return message + "; did you mean '" + elsewhere + "'?";
    const std::string nearest = nearest_word(key, siblings);
    if (!nearest.empty()) return message + "; did you mean '" + nearest + "'?";
    return message + "; known here: " + join(siblings, ", ");
  }

  Result<void> result() const {
    if (problems_.empty()) return {};
    return Error{join(problems_, "\n")};
  }

 private:
  const std::string& name_;
  const std::vector<ConfigField>& fields_;
  std::vector<std::string> problems_;
};

}  // namespace

Result<void> load_fields(const std::string& yaml, const std::string& name,
                         const std::vector<ConfigField>& fields) {
  const auto root = parse_yaml(yaml, name);
  if (!root) return root.failure();
  Loader loader(name, fields);
  loader.load_section(*root, "");
  return loader.result();
}

Result<void> override_field(const std::string& assignment, const std::vector<ConfigField>& fields) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0) {
    return Error{"'" + excerpt(assignment) + "' is not of the form key=value"};
  }
  const std::string path(trim(assignment.substr(0, equals)));
  const std::string text(trim(assignment.substr(equals + 1)));
  const Loader loader("command line", fields);
  const ConfigField* field = loader.find(path);
  if (field == nullptr) {
    const std::size_t dot = path.rfind('.');
    if (dot == std::string::npos) return Error{loader.unknown_key(path, "")};
    const std::string section = path.substr(0, dot);
    const ConfigField* parent = loader.find(section);
    if (parent != nullptr && parent->is_section()) {
      return Error{loader.unknown_key(path.substr(dot + 1), section)};
    }
    std::vector<std::string> paths;
    for (const ConfigField& known : fields) paths.push_back(known.path);
    const std::string nearest = nearest_word(path, paths);
    return Error{"unknown key '" + excerpt(path) + "'" +
                 (nearest.empty() ? "" : "; did you mean '" + nearest + "'?")};
  }
  if (field->is_section()) return Error{"'" + path + "' is a section: name a key of it"};
  if (auto* const target = std::get_if<std::string*>(&field->target);
      target != nullptr && (text.empty() || text[0] != '"')) {
    **target = text;
    return {};
  }
  const bool bare_list = field_kind(*field).starts_with("a list") && !text.starts_with("[");
  const auto node = parse_yaml(bare_list ? "[" + text + "]" : text, path);
  if (!node) return node.failure();
  return set_field(*field, *node);
}

std::string field_to_yaml(const ConfigField& field) {
  return std::visit(Overloaded{[](const SectionField&) { return std::string(); },
                               [](const EnumField& choice) { return choice.names[choice.get()]; },
                               [](const auto* value) { return value_text(*value); }},
                    field.target);
}

std::string field_kind(const ConfigField& field) {
  return std::visit(
      Overloaded{[](const SectionField&) -> std::string { return "a section"; },
                 [](const bool*) -> std::string { return "true or false"; },
                 [](const int*) -> std::string { return "a whole number"; },
                 [](const std::int64_t*) -> std::string { return "a whole number"; },
                 [](const std::uint64_t*) -> std::string { return "a whole number, not negative"; },
                 [](const float*) -> std::string { return "a number"; },
                 [](const double*) -> std::string { return "a number"; },
                 [](const std::string*) -> std::string { return "a text"; },
                 [](const std::vector<int>*) -> std::string { return "a list of whole numbers"; },
                 [](const std::vector<double>*) -> std::string { return "a list of numbers"; },
                 [](const std::vector<std::string>*) -> std::string { return "a list of texts"; },
                 [](const EnumField& choice) { return "one of " + join(choice.names, "|"); }},
      field.target);
}

std::string dump_fields(const std::vector<ConfigField>& fields) {
  std::string out;
  for (const ConfigField& field : fields) {
    const auto depth =
        static_cast<std::size_t>(std::count(field.path.begin(), field.path.end(), '.'));
    const std::size_t dot = field.path.rfind('.');
    const std::string key = dot == std::string::npos ? field.path : field.path.substr(dot + 1);
    std::string line = std::string(2 * depth, ' ') + key + ":";
    if (!field.is_section()) line += " " + field_to_yaml(field);
    std::string help = field.help;
    if (std::holds_alternative<EnumField>(field.target)) {
      help += " (" + field_kind(field) + ")";
    }
    out += line + "  # " + help + "\n";
  }
  return out;
}

Result<std::string> read_config_file(const std::string& path) { return read_text_file(path); }

}  // namespace sovo
