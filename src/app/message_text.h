#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace sovo::app {

/// A decoded message for people: a line a field, nested ones indented; long arrays are cut and say
/// how long they are.
std::string message_text(const nlohmann::ordered_json& message);

}  // namespace sovo::app
