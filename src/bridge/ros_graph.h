#pragma once

#include <memory>
#include <mutex>
#include <string>

#include "sovo/bridge/dds_config.h"
#include "sovo/bridge/dds_handle.h"

namespace sovo::bridge {

/// Descriptor of the graph message in the layout of a ROS 2 release.
dds_topic_descriptor_t graph_descriptor(RosGraph layout);

/// Writes `ros_discovery_info`: which node owns which readers and writers, so that `ros2 node list`
/// and `ros2 topic info -v` name this process.
class RosGraphWriter {
 public:
  static Result<std::unique_ptr<RosGraphWriter>> open(dds_entity_t participant, RosGraph layout,
                                                      const std::string& node_namespace,
                                                      const std::string& node);

  /// Writes the whole graph of the participant as it is now.
  void publish();

 private:
  RosGraphWriter() = default;

  template <class Info>
  void write() const;

  dds_entity_t participant_ = 0;
  RosGraph layout_ = RosGraph::kIronPlus;
  std::string namespace_;
  std::string node_;
  DdsHandle topic_;
  DdsHandle writer_;
  std::mutex mutex_;
};

}  // namespace sovo::bridge
