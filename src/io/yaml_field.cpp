#include "sovo/io/yaml_field.h"

#include "sovo/io/text.h"
#include "sovo/io/yaml_node.h"

namespace sovo {
namespace {

/// The value of a key; looked up by hand so that nothing but plain keys is ever compared.
std::optional<YAML::Node> lookup(const YAML::Node& map, const std::string& key) {
  if (!map.IsMap()) return std::nullopt;
  for (const auto& entry : map) {
    if (entry.first.IsScalar() && entry.first.Scalar() == key) return entry.second;
  }
  return std::nullopt;
}

void append_numbers(const YamlField& field, const YAML::Node& node, int depth,
                    std::vector<double>* out) {
  if (node.IsSequence() && depth < 2) {
    for (const YAML::Node& element : node) append_numbers(field, element, depth + 1, out);
    return;
  }
  if (!node.IsScalar()) throw field.error("must be a list of numbers");
  const auto value = parse_double(node.Scalar());
  if (!value) {
    throw field.error("must hold finite numbers, not '" + excerpt(node.Scalar()) + "'");
  }
  out->push_back(*value);
}

}  // namespace

bool YamlField::has(const std::string& key) const { return lookup(node_, key).has_value(); }

YamlField YamlField::at(const std::string& key) const {
  auto value = lookup(node_, key);
  if (!value) throw error("'" + key + "' is missing");
  return {file_, *value, path_.empty() ? key : path_ + "." + key};
}

std::optional<YamlField> YamlField::find_any(std::initializer_list<const char*> keys) const {
  for (const char* key : keys) {
    if (has(key)) return at(key);
  }
  return std::nullopt;
}

YamlField YamlField::at_any(std::initializer_list<const char*> keys) const {
  auto found = find_any(keys);
  return found ? *found : at(*keys.begin());
}

double YamlField::number() const {
  const auto value = node_.IsScalar() ? parse_double(node_.Scalar()) : std::nullopt;
  if (!value) throw error("must be a finite number");
  return *value;
}

int YamlField::whole_number() const {
  const auto value = node_.IsScalar() ? parse_integer(node_.Scalar()) : std::nullopt;
  if (!value || std::abs(*value) > 1000000) throw error("must be a whole number");
  return static_cast<int>(*value);
}

std::string YamlField::text() const {
  if (!node_.IsScalar()) throw error("must be a text");
  return node_.Scalar();
}

std::vector<double> YamlField::numbers() const {
  if (node_.IsMap()) {
    const std::vector<double> data = at("data").numbers();
    if (has("rows") && has("cols") &&
        static_cast<double>(data.size()) != at("rows").number() * at("cols").number()) {
      throw error("has " + std::to_string(data.size()) + " numbers, not rows x cols");
    }
    return data;
  }
  if (!node_.IsSequence()) throw error("must be a list of numbers");
  std::vector<double> values;
  append_numbers(*this, node_, 0, &values);
  return values;
}

std::vector<double> YamlField::numbers(std::size_t count) const {
  std::vector<double> values = numbers();
  if (values.size() != count) {
    throw error("has " + std::to_string(values.size()) + " numbers; " + std::to_string(count) +
                " are needed");
  }
  return values;
}

MatX YamlField::matrix(int rows, int cols) const {
  const std::vector<double> values = numbers(static_cast<std::size_t>(rows * cols));
  return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
      values.data(), rows, cols);
}

FormatError YamlField::error(const std::string& what) const {
  const std::string name = path_.empty() ? "" : "'" + path_ + "' ";
  return FormatError(at_line(file_, node_) + name + what);
}

}  // namespace sovo
