#pragma once

#include <string>

#include "sovo/bridge/topic_qos.h"

namespace sovo::bridge {

/// The quality of service of a writer as ROS 2's bags tell it: a YAML list with one profile.
std::string offered_qos_text(const TopicQos& qos);

/// The first profile of such a text; `fallback` where it says nothing.
TopicQos parse_offered_qos(const std::string& text, const TopicQos& fallback);

}  // namespace sovo::bridge
