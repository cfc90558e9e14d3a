#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace sovo {

/// An enumeration member with its type erased.
struct EnumField {
  std::vector<std::string> names;
  std::function<std::size_t()> get;      ///< Index into names.
  std::function<void(std::size_t)> set;  ///< Index into names.
};

/// A section: a nested struct.
struct SectionField {};

/// Where a field's value lives.
using ConfigTarget = std::variant<SectionField, bool*, int*, std::int64_t*, std::uint64_t*, float*,
                                  double*, std::string*, std::vector<int>*, std::vector<double>*,
                                  std::vector<std::string>*, EnumField>;

/// One field of a configuration, as files and command lines see it.
struct ConfigField {
  std::string path;  ///< Keys from the root, joined by dots.
  std::string help;
  ConfigTarget target;

  bool is_section() const { return std::holds_alternative<SectionField>(target); }
};

/// Visitor of a configuration struct, which names its members to it in a template member function
/// `visit`: `v("key", member, "help")`. Members are those of `ConfigTarget`, enumerations that have
/// a function `enum_names(E)` (an array of values with names, found by argument-dependent lookup),
/// and further configuration structs. Collects the fields in the order of the visit, a section
/// before what is in it.
class SchemaVisitor {
 public:
  template <class T>
  void operator()(const char* key, T& member, const char* help) {
    const std::string path = prefix_ + key;
    if constexpr (std::is_enum_v<T>) {
      fields_.push_back({path, help, enum_field(member)});
    } else if constexpr (std::is_constructible_v<ConfigTarget, T*>) {
      fields_.push_back({path, help, &member});
    } else {
      fields_.push_back({path, help, SectionField{}});
      const std::string outer = std::exchange(prefix_, path + ".");
      member.visit(*this);
      prefix_ = outer;
    }
  }

  std::vector<ConfigField> take() { return std::move(fields_); }

 private:
  template <class E>
  static EnumField enum_field(E& member) {
    EnumField field;
    for (const auto& [value, name] : enum_names(E{})) field.names.emplace_back(name);
    E* target = &member;
    field.get = [target] {
      const auto table = enum_names(E{});
      std::size_t i = 0;
      while (i + 1 < table.size() && table[i].first != *target) ++i;
      return i;
    };
    field.set = [target](std::size_t i) { *target = enum_names(E{})[i].first; };
    return field;
  }

  std::string prefix_;
  std::vector<ConfigField> fields_;
};

/// Fields of a configuration. They point into `config`, which must outlive them.
template <class T>
std::vector<ConfigField> config_schema(T* config) {
  SchemaVisitor visitor;
  config->visit(visitor);
  return visitor.take();
}

}  // namespace sovo
