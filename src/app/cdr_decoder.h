#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "sovo/io/result.h"

namespace sovo::app {

/// Decodes serialized messages of one type by the text of its .msg file.
class CdrDecoder {
 public:
  /// `definition`: the .msg text, followed by those of all types in it, each after a line of 80 `=`
  /// and one with `MSG: package/Name` (ROS's schema encoding "ros2msg"). `type`: its ROS name, as
  /// "nav_msgs/msg/Odometry".
  static Result<CdrDecoder> make(const std::string& type, const std::string& definition);

  /// Fields in their order; what is not finite becomes null. The bytes begin with the encapsulation
  /// header and may come from anyone: an error says where they do not hold what the type asks for.
  Result<nlohmann::ordered_json> decode(std::span<const std::uint8_t> bytes) const;

 private:
  enum class Array { kNone, kFixed, kSequence };
  struct Field {
    std::string name;
    std::string base;        ///< A primitive's name, or empty for a nested type.
    std::size_t nested = 0;  ///< Index of the nested type.
    Array array = Array::kNone;
    std::uint32_t length = 0;  ///< Of a fixed array.
  };
  struct Type {
    std::string name;  ///< "package/Name"
    std::vector<Field> fields;
  };
  class Reader;
  class Parser;

  std::vector<Type> types_;  ///< The message itself first.
};

}  // namespace sovo::app
