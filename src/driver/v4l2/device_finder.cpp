#include "sovo/driver/v4l2/device_finder.h"

#include <utility>

namespace sovo::v4l2 {

DeviceFinder::DeviceFinder(std::vector<std::string> wishes, DeviceTree tree)
    : wishes_(std::move(wishes)), tree_(std::move(tree)), known_(wishes_.size()) {}

Result<DeviceInfo> DeviceFinder::find(std::size_t i) {
  const auto devices = list_devices(tree_);
  const std::scoped_lock lock(mutex_);
  std::optional<DeviceInfo>& known = known_[i];
  std::vector<DeviceInfo> others;
  for (std::size_t j = 0; j < known_.size(); ++j) {
    if (j != i && known_[j]) others.push_back(*known_[j]);
  }
  auto found =
      known ? find_again(devices, *known, wishes_[i], others) : find_device(devices, wishes_[i]);
  if (!found) return found;
  for (const DeviceInfo& other : others) {
    if (!is_same(*found, other)) continue;
    return Error{"'" + wishes_[i] + "' is " + found->path + ", which is the other camera already"};
  }
  known = *found;
  return found;
}

}  // namespace sovo::v4l2
