#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "sovo/io/result.h"

namespace sovo {

/// One line of a file of columns, that knows where it stands.
class NumberLine {
 public:
  NumberLine(const std::string* path, int number, std::vector<std::string_view> fields)
      : path_(path), line_(number), fields_(std::move(fields)) {}

  std::size_t size() const { return fields_.size(); }
  std::string_view field(std::size_t i) const { return fields_[i]; }

  /// A finite number; the error names file, line and field.
  Result<double> number(std::size_t i, const std::string& name) const;

  /// "file:line: what".
  Error error(const std::string& what) const;

  /// "file:line: NAME must be WANTED, not '...'".
  Error bad_field(std::size_t i, const std::string& name, const std::string& wanted) const;

 private:
  const std::string* path_;
  int line_;
  std::vector<std::string_view> fields_;
};

/// A text file of columns; empty lines and what follows a '#' are left out.
class NumberFile {
 public:
  static Result<NumberFile> read(const std::string& path, std::string_view separators);

  const std::vector<NumberLine>& lines() const { return lines_; }
  const std::string& path() const { return content_->path; }

  /// Whether the first line with content has a comma.
  bool has_commas() const { return has_commas_; }

 private:
  /// What the lines point into; it stays where it is when the file is moved.
  struct Content {
    std::string path;
    std::string text;
  };
  std::shared_ptr<const Content> content_;
  std::vector<NumberLine> lines_;
  bool has_commas_ = false;
};

}  // namespace sovo
