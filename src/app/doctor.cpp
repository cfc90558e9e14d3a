#include "sovo/app/doctor.h"

#include <unistd.h>

#include <filesystem>
#include <map>
#include <optional>

#include "sovo/driver/v4l2/device_list.h"
#include "sovo/io/text.h"

namespace sovo::app {
namespace {

namespace fs = std::filesystem;
using Findings = std::vector<Finding>;

constexpr std::int64_t kReceiveBuffer = 33'554'432;    // as config/sysctl says [bytes]
constexpr std::int64_t kFragmentMemory = 134'217'728;  // [bytes]
constexpr std::int64_t kUsb3 = 5000;                   // [Mbit/s]

/// First line of a file; nothing when it cannot be read.
std::optional<std::string> first_line(const std::string& path) {
  const auto text = read_text_file(path);
  if (!text) return std::nullopt;
  const auto lines = split_lines(*text);
  return lines.empty() ? "" : std::string(trim(lines.front()));
}

std::optional<std::int64_t> number_in(const std::string& path) {
  const auto line = first_line(path);
  return line ? parse_integer(*line) : std::nullopt;
}

std::string sysctl_line(const std::string& key, std::int64_t value) {
  return "echo '" + key + "=" + std::to_string(value) +
         "' | sudo tee -a /etc/sysctl.d/60-sovo-dds.conf && sudo sysctl --system";
}

void check_sysctl(const std::string& root, const std::string& key, std::int64_t least,
                  const std::string& why, Findings* findings) {
  std::string path = key;
  for (char& c : path) c = c == '.' ? '/' : c;
  const auto value = number_in(root + "/proc/sys/" + path);
  if (!value) return;  // not told in this container
  const std::string text = key + " is " + std::to_string(*value);
  if (*value >= least) {
    findings->push_back({true, text, ""});
  } else {
    findings->push_back({false, text + ": " + why, sysctl_line(key, least)});
  }
}

void check_governor(const std::string& root, Findings* findings) {
  const auto governor = first_line(root + "/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor");
  if (!governor) return;  // a virtual machine, or a processor of one speed
  const bool good = *governor == "performance";
  findings->push_back(
      {good, "the CPU governor is " + *governor + (good ? "" : ": a slowed processor adds latency"),
       good ? ""
            : "echo performance | sudo tee /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor"});
}

void check_device(const v4l2::DeviceInfo& info, const std::string& root, Findings* findings) {
  const bool allowed = ::access(info.path.c_str(), R_OK | W_OK) == 0;
  findings->push_back({allowed,
                       info.path + " (" + info.name + ") " +
                           (allowed ? "may be opened" : "may not be opened by this user"),
                       allowed ? "" : "sudo usermod -aG video $USER  # then log in again"});
  if (info.port.empty()) return;
  const auto speed = parse_integer(info.speed_mbps);
  if (info.is_zed() && speed && *speed < kUsb3) {
    findings->push_back({false,
                         info.path + " is connected at " + info.speed_mbps +
                             " Mbit/s: only 1344x376 will run; plug it into a USB 3 port",
                         "sovo camera list  # shows 5000 Mbit/s at a USB 3 port"});
  }
  const std::string usb = root + "/sys/bus/usb/devices/" + info.port;
  if (first_line(usb + "/power/control") == "auto") {
    findings->push_back({false, info.path + " may be put to sleep by the USB bus",
                         "echo 'ACTION==\"add\", SUBSYSTEM==\"usb\", ATTR{idVendor}==\"" +
                             info.vendor_id +
                             "\", TEST==\"power/control\", ATTR{power/control}=\"on\"' | sudo tee "
                             "/etc/udev/rules.d/60-sovo-camera.rules && sudo udevadm control "
                             "--reload && sudo udevadm trigger"});
  }
}

void check_cameras(const std::string& root, Findings* findings) {
  const auto devices = v4l2::list_devices({root + "/sys/class/video4linux", root + "/dev"});
  for (const auto& info : devices) check_device(info, root, findings);
  if (devices.empty()) findings->push_back({true, "no V4L2 camera is attached", ""});
}

/// Interfaces that are up and could carry cameras: large packets cost less.
void check_interfaces(const std::string& root, Findings* findings) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(root + "/sys/class/net", error)) {
    const std::string name = entry.path().filename().string();
    const auto mtu = number_in(entry.path().string() + "/mtu");
    const auto state = first_line(entry.path().string() + "/operstate");
    const bool wired =
        fs::exists(entry.path() / "device", error) && !fs::exists(entry.path() / "wireless", error);
    if (!wired || !mtu || state != "up") continue;
    std::string text = "interface " + name + " has an MTU of " + std::to_string(*mtu);
    if (*mtu < 9000) {
      text += "; where GigE cameras are on it and they allow it: sudo ip link set dev " + name +
              " mtu 9000";
    }
    findings->push_back({true, text, ""});
  }
}

/// Counters of /proc/net/snmp: a line of names, then one of numbers.
std::map<std::string, std::int64_t> network_counters(const std::string& root) {
  std::map<std::string, std::int64_t> counters;
  const auto text = read_text_file(root + "/proc/net/snmp");
  if (!text) return counters;
  const auto lines = split_lines(*text);
  for (std::size_t i = 0; i + 1 < lines.size(); i += 2) {
    const auto names = split(lines[i], " ");
    const auto values = split(lines[i + 1], " ");
    for (std::size_t k = 1; k < names.size() && k < values.size(); ++k) {
      counters[std::string(names[0]) + std::string(names[k])] =
          parse_integer(values[k]).value_or(0);
    }
  }
  return counters;
}

void check_losses(const std::string& root, Findings* findings) {
  const auto counters = network_counters(root);
  const auto count = [&counters](const char* name) {
    const auto at = counters.find(name);
    return at == counters.end() ? 0 : at->second;
  };
  if (counters.empty()) return;
  const std::int64_t full = count("Udp:RcvbufErrors");
  const std::int64_t parts = count("Ip:ReasmFails");
  findings->push_back({full == 0,
                       std::to_string(full) + " UDP packets were dropped since the start of the "
                                              "machine because a receive buffer was full",
                       full == 0 ? "" : sysctl_line("net.core.rmem_max", kReceiveBuffer)});
  findings->push_back(
      {parts == 0, std::to_string(parts) + " large UDP packets could not be put together again",
       parts == 0 ? "" : sysctl_line("net.ipv4.ipfrag_high_thresh", kFragmentMemory)});
}

}  // namespace

std::vector<Finding> examine_machine(const std::string& root) {
  Findings findings;
  check_cameras(root, &findings);
  check_sysctl(root, "net.core.rmem_max", kReceiveBuffer, "bursts of images are lost", &findings);
  check_sysctl(root, "net.ipv4.ipfrag_high_thresh", kFragmentMemory,
               "large messages are lost in parts", &findings);
  check_losses(root, &findings);
  check_interfaces(root, &findings);
  check_governor(root, &findings);
  return findings;
}

}  // namespace sovo::app
