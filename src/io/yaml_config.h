#pragma once

#include <string>

#include "sovo/io/config_schema.h"
#include "sovo/io/result.h"

namespace sovo {

/// Sets `fields` from YAML text; what it does not name stays as it is. Refused, with every place
/// named as `name`:line: unknown keys (with the nearest known one), repeated keys, wrong types,
/// numbers that are not finite. On failure some fields may have been set.
Result<void> load_fields(const std::string& yaml, const std::string& name,
                         const std::vector<ConfigField>& fields);

/// Sets one field from "path.to.key=value"; the value is written as in YAML, the quotes of a text
/// may be left out and a list may be "1,2,3".
Result<void> override_field(const std::string& assignment, const std::vector<ConfigField>& fields);

/// YAML text of the fields, the help texts as comments. Reading it back gives the same values.
std::string dump_fields(const std::vector<ConfigField>& fields);

/// Value of one field as YAML; empty for a section.
std::string field_to_yaml(const ConfigField& field);

/// Kind of value a field takes, for help texts: "number", "whole number", "text", "one of a|b", ...
std::string field_kind(const ConfigField& field);

/// `load_fields` from text into a configuration struct, which is left unchanged on failure.
template <class T>
Result<void> load_config_text(const std::string& yaml, const std::string& name, T* config) {
  T loaded = *config;
  auto result = load_fields(yaml, name, config_schema(&loaded));
  if (result) *config = std::move(loaded);
  return result;
}

/// Reads the text of the configuration file; the error names it.
Result<std::string> read_config_file(const std::string& path);

/// As `load_config_text`, from a file.
template <class T>
Result<void> load_config(const std::string& path, T* config) {
  const auto text = read_config_file(path);
  if (!text) return text.failure();
  return load_config_text(*text, path, config);
}

/// `override_field` on a configuration struct.
template <class T>
Result<void> apply_override(T* config, const std::string& assignment) {
  return override_field(assignment, config_schema(config));
}

/// `dump_fields` of a configuration struct.
template <class T>
std::string dump_config(const T& config) {
  T copy = config;
  return dump_fields(config_schema(&copy));
}

}  // namespace sovo
