#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>

#include "message_traits.h"

namespace sovo::app {

/// A message as JSON, fields in their order; what is not finite becomes null.
template <class T>
nlohmann::ordered_json to_json(const T& value) {
  using Json = nlohmann::ordered_json;
  if constexpr (std::is_arithmetic_v<T>) {
    return value;
  } else if constexpr (std::is_convertible_v<T, const char*>) {
    return value == nullptr ? Json("") : Json(std::string(value));
  } else if constexpr (std::is_array_v<T>) {
    Json json = Json::array();
    for (const auto& element : value) json.push_back(to_json(element));
    return json;
  } else if constexpr (requires { value._buffer; }) {
    Json json = Json::array();
    for (std::uint32_t i = 0; i < value._length; ++i) json.push_back(to_json(value._buffer[i]));
    return json;
  } else {
    Json json = Json::object();
    bridge::MessageTraits<T>::visit(
        value, [&json](const char* name, const auto& field) { json[name] = to_json(field); });
    return json;
  }
}

}  // namespace sovo::app
