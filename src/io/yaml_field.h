#pragma once

#include <yaml-cpp/yaml.h>

#include <initializer_list>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "sovo/geometry/types.h"

namespace sovo {

/// A file that is not what its format asks for; the message names file, line and field. Thrown by
/// parsers, caught where a file is loaded; never leaves the room.
class FormatError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A node of a YAML document that knows the file and the keys that lead to it. What is asked of it
/// and is not there, or is of another type, throws a `FormatError`.
class YamlField {
 public:
  YamlField(std::string file, const YAML::Node& node) : file_(std::move(file)), node_(node) {}

  const std::string& file() const { return file_; }
  bool is_map() const { return node_.IsMap(); }
  bool has(const std::string& key) const;

  /// The field of that name.
  YamlField at(const std::string& key) const;
  /// The first that there is of several names.
  YamlField at_any(std::initializer_list<const char*> keys) const;
  std::optional<YamlField> find_any(std::initializer_list<const char*> keys) const;

  double number() const;
  int whole_number() const;
  std::string text() const;
  /// A flat list of numbers, or the `data` of a {rows, cols, data} matrix, or a list of rows.
  std::vector<double> numbers() const;
  /// As above, of exactly this many.
  std::vector<double> numbers(std::size_t count) const;
  /// `numbers` as a matrix, row-major.
  MatX matrix(int rows, int cols) const;

  /// "file:line: 'key.path' what", to be thrown.
  FormatError error(const std::string& what) const;

 private:
  YamlField(std::string file, const YAML::Node& node, std::string path)
      : file_(std::move(file)), node_(node), path_(std::move(path)) {}

  std::string file_;
  YAML::Node node_;
  std::string path_;  ///< Keys from the root, joined by dots.
};

}  // namespace sovo
