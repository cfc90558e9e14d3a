#include "sovo/bridge/message_schema.h"

#include <algorithm>

#include "message_traits.h"
#include "sovo/bridge/ros_names.h"

namespace sovo::bridge {
namespace {

std::vector<MessageSchema> known_schemas() {
  std::vector<MessageSchema> schemas;
  for_each_message_type([&]<class T>() {
    using Traits = MessageTraits<T>;
    schemas.push_back(
        {Traits::kRosName, dds_type(Traits::kRosName), Traits::kHash, Traits::kDefinition});
  });
  return schemas;
}

}  // namespace

const std::vector<MessageSchema>& message_schemas() {
  static const std::vector<MessageSchema> schemas = known_schemas();
  return schemas;
}

const MessageSchema* find_schema(const std::string& ros_or_dds_name) {
  const auto& schemas = message_schemas();
  const auto found = std::find_if(schemas.begin(), schemas.end(), [&](const MessageSchema& s) {
    return s.ros_name == ros_or_dds_name || s.dds_name == ros_or_dds_name;
  });
  return found == schemas.end() ? nullptr : &*found;
}

TypeInfo raw_type(const MessageSchema& schema) {
  return {nullptr, schema.type_hash.c_str(), schema.dds_name.c_str()};
}

}  // namespace sovo::bridge
