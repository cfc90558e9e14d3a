#pragma once

#include <yaml-cpp/yaml.h>

#include <string>

#include "sovo/io/result.h"

namespace sovo {

/// The one YAML document of `text`; null when it is empty. `name` is the file for messages.
Result<YAML::Node> parse_yaml(const std::string& text, const std::string& name);

/// "file:line: " of a node.
std::string at_line(const std::string& name, const YAML::Node& node);

/// Whether the node is a scalar without quotes, as numbers and truth values are written.
bool is_plain_scalar(const YAML::Node& node);

}  // namespace sovo
