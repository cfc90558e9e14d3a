#include "sovo/driver/v4l2/device_list.h"

#include <algorithm>
#include <filesystem>

#include "sovo/io/text.h"

namespace sovo::v4l2 {
namespace {

namespace fs = std::filesystem;

/// First line of an attribute of /sys; empty when it is not there.
std::string attribute(const fs::path& file) {
  const auto text = read_text_file(file.string());
  if (!text) return {};
  const auto lines = split_lines(*text);
  return lines.empty() ? "" : std::string(trim(lines.front()));
}

/// The USB device is the parent of the interface that the driver bound.
void add_usb(const fs::path& node, DeviceInfo* info) {
  std::error_code error;
  const fs::path device = fs::canonical(node / "device", error);
  if (error) return;
  const fs::path usb = device.parent_path();
  info->vendor_id = attribute(usb / "idVendor");
  if (info->vendor_id.empty()) return;
  info->product_id = attribute(usb / "idProduct");
  info->serial = attribute(usb / "serial");
  info->speed_mbps = attribute(usb / "speed");
  info->port = usb.filename().string();
}

void add_links(const std::string& dev, std::vector<DeviceInfo>* devices) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(dev + "/v4l/by-id", error)) {
    std::error_code unresolved;
    const std::string target = fs::canonical(entry.path(), unresolved).string();
    for (DeviceInfo& info : *devices) {
      if (!unresolved && info.path == target) info.by_id = entry.path().string();
    }
  }
}

bool is_meant(const DeviceInfo& info, const std::string& wish) {
  return !wish.empty() && (info.path == wish || info.by_id == wish || info.serial == wish ||
                           info.port == wish || fs::path(info.by_id).filename() == wish);
}

std::string listing(const std::vector<DeviceInfo>& devices) {
  if (devices.empty()) return "there is no video device; is the camera plugged in?";
  std::string text = "there are:";
  for (const DeviceInfo& info : devices) {
    text += " " + info.path + " (" + info.name;
    if (!info.serial.empty()) text += ", serial " + info.serial;
    text += ")";
  }
  return text;
}

/// Of a device's several nodes, the one that gives images.
Result<DeviceInfo> only_one(std::vector<DeviceInfo> found, const std::string& what,
                            const std::vector<DeviceInfo>& all) {
  const auto first =
      std::min_element(found.begin(), found.end(),
                       [](const DeviceInfo& a, const DeviceInfo& b) { return a.index < b.index; });
  if (first == found.end()) return Error{"no camera is " + what + "; " + listing(all)};
  const auto same_rank = std::count_if(found.begin(), found.end(), [&first](const DeviceInfo& i) {
    return i.index == first->index;
  });
  if (same_rank > 1) {
    return Error{"several cameras are " + what + ": name one by its path or port; " + listing(all)};
  }
  return *first;
}

template <class Wanted>
std::vector<DeviceInfo> those(const std::vector<DeviceInfo>& devices, const Wanted& wanted) {
  std::vector<DeviceInfo> found;
  std::copy_if(devices.begin(), devices.end(), std::back_inserter(found), wanted);
  return found;
}

}  // namespace

std::vector<DeviceInfo> list_devices(const DeviceTree& tree) {
  std::vector<DeviceInfo> devices;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(tree.sys, error)) {
    const std::string node = entry.path().filename().string();
    if (!node.starts_with("video")) continue;
    DeviceInfo info;
    info.path = tree.dev + "/" + node;
    info.name = attribute(entry.path() / "name");
    info.index = static_cast<int>(parse_integer(attribute(entry.path() / "index")).value_or(0));
    add_usb(entry.path(), &info);
    devices.push_back(std::move(info));
  }
  std::sort(devices.begin(), devices.end(), [](const DeviceInfo& a, const DeviceInfo& b) {
    return std::pair(a.path.size(), a.path) < std::pair(b.path.size(), b.path);
  });
  add_links(tree.dev, &devices);
  return devices;
}

Result<DeviceInfo> find_device(const std::vector<DeviceInfo>& devices, const std::string& wish) {
  if (wish.empty()) {
    auto zeds = those(devices, [](const DeviceInfo& info) { return info.is_zed(); });
    if (!zeds.empty()) return only_one(std::move(zeds), "a ZED", devices);
    return only_one(devices, "attached", devices);
  }
  auto found = those(devices, [&wish](const DeviceInfo& info) { return is_meant(info, wish); });
  if (!found.empty()) return only_one(std::move(found), "'" + wish + "'", devices);
  // A link of the user's own, or one that udev made elsewhere.
  std::error_code error;
  const std::string target = fs::canonical(wish, error).string();
  if (!error) {
    found = those(devices, [&target](const DeviceInfo& info) { return info.path == target; });
  }
  return only_one(std::move(found), "'" + wish + "'", devices);
}

bool is_same(const DeviceInfo& a, const DeviceInfo& b) {
  if (a.vendor_id.empty() || b.vendor_id.empty()) return a.path == b.path;
  return a.port == b.port && a.serial == b.serial;
}

Result<DeviceInfo> find_again(const std::vector<DeviceInfo>& devices, const DeviceInfo& known,
                              const std::string& wish, const std::vector<DeviceInfo>& others) {
  if (known.vendor_id.empty()) return find_device(devices, wish);
  const auto alike = those(devices, [&known](const DeviceInfo& info) {
    return info.vendor_id == known.vendor_id && info.product_id == known.product_id &&
           info.index == known.index;
  });
  const auto same_port = those(alike, [&known](const auto& i) { return i.port == known.port; });
  const bool telling = !known.serial.empty() &&
                       std::none_of(others.begin(), others.end(),
                                    [&known](const auto& o) { return o.serial == known.serial; });
  const auto same_serial =
      those(alike, [&](const auto& i) { return telling && i.serial == known.serial; });
  const auto same_both =
      those(same_port, [&known](const auto& i) { return i.serial == known.serial; });
  for (const auto& found : {same_both, same_serial, same_port}) {
    if (found.size() == 1) return found.front();
  }
  return Error{known.name + " (port " + known.port + ") is gone; waiting for it"};
}

}  // namespace sovo::v4l2
