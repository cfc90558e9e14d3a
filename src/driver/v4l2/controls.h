#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sovo/driver/v4l2/v4l2_file.h"

namespace sovo::v4l2 {

/// A control of a device, named as v4l2-ctl does: "exposure_time_absolute".
struct ControlInfo {
  std::string name;
  std::uint32_t id = 0;
  std::uint32_t type = 0;  ///< V4L2_CTRL_TYPE_...
  std::int64_t least = 0;
  std::int64_t most = 0;
  std::int64_t step = 1;
  std::int64_t preset = 0;
  std::int64_t value = 0;
  bool read_only = false;
  bool inactive = false;          ///< Another control, such as an automatic one, overrules it now.
  std::vector<std::string> menu;  ///< "1: Manual Mode", of a menu.
};

/// A control that shall have a value.
struct ControlSetting {
  std::string name;
  std::int64_t value = 0;
};

/// Settings from "name=value" texts. The error names the text.
Result<std::vector<ControlSetting>> parse_controls(const std::vector<std::string>& texts);

/// "Exposure Time, Absolute" as "exposure_time_absolute".
std::string control_name(const std::string& label);

/// All controls of a device with their values now.
std::vector<ControlInfo> list_controls(const DeviceFile& file);

/// The control of that name; "exposure" and "gain" stand for what the device calls so.
const ControlInfo* find_control(const std::vector<ControlInfo>& controls, const std::string& name);

/// Sets the controls in order, reading each back. Exposure by hand takes the automatic one away
/// first. The error names the control, its range or the nearest name; those after it are set all
/// the same.
Result<void> apply_controls(const DeviceFile& file, const std::vector<ControlSetting>& settings);

/// Value of a control now; nothing when it cannot be read.
Result<std::int64_t> read_control(const DeviceFile& file, std::uint32_t id);

}  // namespace sovo::v4l2
