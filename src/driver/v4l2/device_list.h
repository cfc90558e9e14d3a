#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sovo/io/result.h"

namespace sovo::v4l2 {

/// A video device as the kernel's /sys describes it.
struct DeviceInfo {
  std::string path;       ///< "/dev/video0"
  std::string name;       ///< What the driver calls it.
  std::string vendor_id;  ///< USB, four hexadecimal digits; empty for others, as is what follows.
  std::string product_id;
  std::string serial;      ///< Serial number of the USB device.
  std::string port;        ///< USB port, e.g. "1-2.3": stays when it is plugged in again there.
  std::string speed_mbps;  ///< "480", "5000"
  std::string by_id;       ///< Link in /dev/v4l/by-id; empty without udev.
  int index = 0;           ///< Of the device's several nodes; images come from the first.

  bool is_zed() const { return vendor_id == "2b03"; }
};

/// Where to look.
struct DeviceTree {
  std::string sys = "/sys/class/video4linux";
  std::string dev = "/dev";
};

/// All video devices, by number.
std::vector<DeviceInfo> list_devices(const DeviceTree& tree = {});

/// The device that `wish` means: a path, the name of a link in /dev/v4l/by-id, a serial number, a
/// USB port, or, when it is empty, the only ZED or else the only device there is. The error lists
/// what there is.
Result<DeviceInfo> find_device(const std::vector<DeviceInfo>& devices, const std::string& wish);

/// Whether both are one camera: at the same port with the same serial number, or at the same path
/// where that is no USB device.
bool is_same(const DeviceInfo& a, const DeviceInfo& b);

/// The same device after it was plugged in again, perhaps with another number: by serial number and
/// port, else by serial number, else by port, of the same make; as `find_device` for what is no USB
/// device. A serial number that one of `others`, the rig's other cameras, has as well tells
/// nothing.
Result<DeviceInfo> find_again(const std::vector<DeviceInfo>& devices, const DeviceInfo& known,
                              const std::string& wish, const std::vector<DeviceInfo>& others = {});

}  // namespace sovo::v4l2
