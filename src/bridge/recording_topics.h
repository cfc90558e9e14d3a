#pragma once

#include <string>

#include "sovo/bridge/message_schema.h"
#include "sovo/bridge/topic_qos.h"
#include "sovo/io/recording.h"
#include "sovo/io/recording_writer.h"

namespace sovo::bridge {

/// What a recording says of a topic on the bus; `ros_name`: full name.
RecordingTopic recording_topic(const std::string& ros_name, const MessageSchema& schema,
                               const TopicQos& qos);

/// The same topic again, for a copy of a recording.
RecordingTopic recording_topic(const RecordedTopic& topic);

}  // namespace sovo::bridge
