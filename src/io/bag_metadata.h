#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sovo/io/result.h"

namespace sovo {

/// What the metadata.yaml of a ROS 2 bag says.
struct BagMetadata {
  struct Topic {
    std::string name;
    std::string type;
    std::string offered_qos;  ///< YAML list of the writers' profiles.
    std::uint64_t messages = 0;
  };
  struct File {
    std::string name;  ///< Relative to the bag's folder.
    std::uint64_t start_ns = 0;
    std::uint64_t end_ns = 0;
    std::uint64_t messages = 0;
  };
  std::vector<Topic> topics;
  std::vector<File> files;
};

/// The YAML text, in the version that ROS 2 Humble and later read.
std::string to_yaml(const BagMetadata& metadata);

}  // namespace sovo
