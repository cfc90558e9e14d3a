#include "sovo/io/number_lines.h"

#include "sovo/io/text.h"

namespace sovo {

Result<double> NumberLine::number(std::size_t i, const std::string& name) const {
  if (i >= size()) return error(name + " is missing");
  const auto value = parse_double(fields_[i]);
  if (!value) return bad_field(i, name, "a finite number");
  return *value;
}

Error NumberLine::error(const std::string& what) const {
  return {*path_ + ":" + std::to_string(line_) + ": " + what};
}

Error NumberLine::bad_field(std::size_t i, const std::string& name,
                            const std::string& wanted) const {
  return error(name + " must be " + wanted + ", not '" + excerpt(fields_[i]) + "'");
}

Result<NumberFile> NumberFile::read(const std::string& path, std::string_view separators) {
  auto text = read_text_file(path);
  if (!text) return text.failure();
  NumberFile file;
  file.content_ = std::make_shared<const Content>(Content{path, std::move(*text)});
  int number = 0;
  for (std::string_view line : split_lines(file.content_->text)) {
    ++number;
    line = trim(line.substr(0, line.find('#')));
    if (line.empty()) continue;
    if (file.lines_.empty()) file.has_commas_ = line.find(',') != std::string_view::npos;
    file.lines_.emplace_back(&file.content_->path, number, split(line, separators));
  }
  return file;
}

}  // namespace sovo
