#pragma once

#include <cstddef>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "sovo/driver/v4l2/device_list.h"

namespace sovo::v4l2 {

/// Finds the cameras of a rig by what the user called them, and later the same ones again, wherever
/// they were plugged in meanwhile. No camera is taken for the rig's other one. Threads may share
/// it.
class DeviceFinder {
 public:
  /// `wishes`: one a camera, as `find_device` takes them.
  explicit DeviceFinder(std::vector<std::string> wishes, DeviceTree tree = {});

  /// The camera called `wishes[i]`, as it is attached now.
  Result<DeviceInfo> find(std::size_t i);

 private:
  const std::vector<std::string> wishes_;
  const DeviceTree tree_;
  std::mutex mutex_;
  std::vector<std::optional<DeviceInfo>> known_;
};

}  // namespace sovo::v4l2
