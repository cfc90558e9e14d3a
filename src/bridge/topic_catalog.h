#pragma once

#include <string>
#include <vector>

#include "sovo/bridge/message_schema.h"
#include "sovo/bridge/topic_qos.h"

namespace sovo::bridge {

/// A topic of this program.
struct CatalogTopic {
  std::string name;             ///< Below the namespace, or global with a leading slash.
  const MessageSchema* schema;  ///< Never null.
  TopicQos qos;                 ///< As it is written.
  bool on_demand = false;       ///< Encoded and written only while somebody reads it.
};

/// All topics that the processes write.
const std::vector<CatalogTopic>& topic_catalog();

/// The topic of a name as in `CatalogTopic::name`; null for others.
const CatalogTopic* find_topic(const std::string& name);

}  // namespace sovo::bridge
