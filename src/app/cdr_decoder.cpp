#include "sovo/app/cdr_decoder.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>
#include <type_traits>

namespace sovo::app {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<const char*, 15> kPrimitives = {
    "bool",   "byte",  "char",   "int8",    "uint8",   "int16",  "uint16", "int32",
    "uint32", "int64", "uint64", "float32", "float64", "string", "wstring"};

constexpr int kDeepest = 16;  // types may not nest themselves

/// "pkg/Name" of "pkg/msg/Name".
std::string short_name(const std::string& type) {
  const auto first = type.find('/');
  const auto last = type.rfind('/');
  return first == last ? type : type.substr(0, first) + type.substr(last);
}

bool is_primitive(const std::string& name) {
  return std::find(kPrimitives.begin(), kPrimitives.end(), name) != kPrimitives.end();
}

}  // namespace

/// Makes types of a schema text.
class CdrDecoder::Parser {
 public:
  Result<std::vector<Type>> parse(const std::string& type, const std::string& definition) {
    types_.push_back({short_name(type), {}});
    std::istringstream lines(definition);
    std::string line;
    std::string error;
    while (std::getline(lines, line) && error.empty()) error = take_line(line);
    if (error.empty()) error = resolve();
    if (!error.empty()) return Error{"the definition of " + type + " cannot be used: " + error};
    return std::move(types_);
  }

 private:
  /// Empty, or what is wrong.
  std::string take_line(std::string line) {
    line = line.substr(0, line.find('#'));
    std::istringstream words(line);
    std::string type;
    std::string name;
    if (!(words >> type)) return {};
    if (type.find_first_not_of('=') == std::string::npos) return {};
    if (!(words >> name)) return "'" + line + "' is not a field";
    if (type == "MSG:") {
      types_.push_back({short_name(name), {}});
      return {};
    }
    std::string rest;
    const bool is_constant =
        name.find('=') != std::string::npos || (words >> rest && rest.starts_with('='));
    if (is_constant) return {};
    return add_field(type, name);
  }

  std::string add_field(std::string type, const std::string& name) {
    Field field;
    field.name = name;
    const auto bracket = type.find('[');
    if (bracket != std::string::npos) {
      const std::string inside = type.substr(bracket + 1, type.size() - bracket - 2);
      const bool bounded = inside.starts_with("<=");
      field.array = inside.empty() || bounded ? Array::kSequence : Array::kFixed;
      if (field.array == Array::kFixed) {
        if (inside.find_first_not_of("0123456789") != std::string::npos || inside.size() > 6) {
          return "'" + type + "' has no length";
        }
        field.length = static_cast<std::uint32_t>(std::stoul(inside));
      }
      type.resize(bracket);
    }
    type = type.substr(0, type.find("<="));
    field.base = type;
    types_.back().fields.push_back(field);
    return {};
  }

  std::string resolve() {
    for (Type& type : types_) {
      for (Field& field : type.fields) {
        if (is_primitive(field.base)) continue;
        const std::string package = type.name.substr(0, type.name.find('/'));
        const std::string wanted = field.base.find('/') == std::string::npos
                                       ? package + "/" + field.base
                                       : short_name(field.base);
        const auto found = std::find_if(types_.begin(), types_.end(),
                                        [&](const Type& t) { return t.name == wanted; });
        if (found == types_.end()) return "it lacks the type " + wanted;
        field.nested = static_cast<std::size_t>(found - types_.begin());
        field.base.clear();
      }
    }
    return {};
  }

  std::vector<Type> types_;
};

/// Reads one message from its beginning to its end.
class CdrDecoder::Reader {
 public:
  Reader(const std::vector<Type>& types, std::span<const std::uint8_t> body, bool little_endian)
      : types_(types),
        body_(body),
        swapped_(little_endian != (std::endian::native == std::endian::little)) {}

  Json read_type(const Type& type, int depth = 0) {
    if (depth > kDeepest) wrong_ = "types nest too deeply";
    Json json = Json::object();
    for (const Field& field : type.fields) {
      if (!wrong_.empty()) break;
      json[field.name] = read_field(field, depth);
      if (!wrong_.empty() && where_.empty()) where_ = field.name;
    }
    return json;
  }

  /// Empty when all went well.
  std::string problem() const { return wrong_.empty() ? "" : "field " + where_ + ": " + wrong_; }

 private:
  Json read_field(const Field& field, int depth) {
    if (field.array == Array::kNone) return read_one(field, depth);
    const std::uint32_t length =
        field.array == Array::kFixed ? field.length : read_number<std::uint32_t>();
    // Whatever an element is, it takes a byte: a length beyond that is no reason to take memory.
    if (length > body_.size() - at_) {
      wrong_ = "it claims " + std::to_string(length) + " elements, more than the message can hold";
      return nullptr;
    }
    Json json = Json::array();
    for (std::uint32_t i = 0; i < length && wrong_.empty(); ++i) {
      json.push_back(read_one(field, depth));
    }
    return json;
  }

  Json read_one(const Field& field, int depth) {
    const std::string& base = field.base;
    if (base.empty()) return read_type(types_[field.nested], depth + 1);
    if (base == "string") return read_string();
    if (base == "bool") return read_number<std::uint8_t>() != 0;
    if (base == "byte" || base == "char" || base == "uint8") return read_number<std::uint8_t>();
    if (base == "int8") return read_number<std::int8_t>();
    if (base == "int16") return read_number<std::int16_t>();
    if (base == "uint16") return read_number<std::uint16_t>();
    if (base == "int32") return read_number<std::int32_t>();
    if (base == "uint32") return read_number<std::uint32_t>();
    if (base == "int64") return read_number<std::int64_t>();
    if (base == "uint64") return read_number<std::uint64_t>();
    if (base == "float32") return read_number<float>();
    if (base == "float64") return read_number<double>();
    wrong_ = "type " + base + " is not known";
    return nullptr;
  }

  template <class T>
  T read_number() {
    at_ = (at_ + sizeof(T) - 1) / sizeof(T) * sizeof(T);
    T value{};
    if (at_ > body_.size() || body_.size() - at_ < sizeof(T)) {
      at_ = body_.size();
      wrong_ = "the message ends too early";
      return value;
    }
    std::array<std::uint8_t, sizeof(T)> bytes{};
    std::copy_n(body_.begin() + static_cast<std::ptrdiff_t>(at_), sizeof(T), bytes.begin());
    if (swapped_) std::reverse(bytes.begin(), bytes.end());
    std::memcpy(&value, bytes.data(), sizeof(T));
    at_ += sizeof(T);
    return value;
  }

  Json read_string() {
    const auto length = read_number<std::uint32_t>();  // with the zero at the end
    if (length > body_.size() - at_) {
      wrong_ = "the message ends within a text";
      return nullptr;
    }
    std::string text(reinterpret_cast<const char*>(body_.data()) + at_, length);
    at_ += length;
    text.resize(::strnlen(text.data(), text.size()));
    return text;
  }

  const std::vector<Type>& types_;
  std::span<const std::uint8_t> body_;
  bool swapped_;
  std::size_t at_ = 0;
  std::string wrong_;
  std::string where_;
};

Result<CdrDecoder> CdrDecoder::make(const std::string& type, const std::string& definition) {
  auto types = Parser().parse(type, definition);
  if (!types) return types.failure();
  CdrDecoder decoder;
  decoder.types_ = std::move(*types);
  return decoder;
}

Result<nlohmann::ordered_json> CdrDecoder::decode(std::span<const std::uint8_t> bytes) const {
  constexpr std::size_t kHeader = 4;
  if (bytes.size() < kHeader || bytes[0] != 0 || bytes[1] > 1) {
    return Error{"a message of " + types_.front().name + " is not plain CDR"};
  }
  Reader reader(types_, bytes.subspan(kHeader), bytes[1] == 1);
  Json json = reader.read_type(types_.front());
  const std::string problem = reader.problem();
  if (!problem.empty()) return Error{"a message of " + types_.front().name + ", " + problem};
  return json;
}

}  // namespace sovo::app
