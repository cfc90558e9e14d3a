#include "sovo/driver/v4l2/controls.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <cctype>

#include "sovo/io/text.h"

namespace sovo::v4l2 {
namespace {

/// Names that people use, and the controls that they may mean, the likeliest first.
struct Alias {
  const char* name;
  std::uint32_t ids[3];
};
constexpr Alias kAliases[] = {
    {"exposure", {V4L2_CID_EXPOSURE_ABSOLUTE, V4L2_CID_EXPOSURE, 0}},
    {"gain", {V4L2_CID_ANALOGUE_GAIN, V4L2_CID_GAIN, 0}},
    {"auto_exposure", {V4L2_CID_EXPOSURE_AUTO, 0, 0}},
    {"exposure_auto", {V4L2_CID_EXPOSURE_AUTO, 0, 0}},
    {"exposure_absolute", {V4L2_CID_EXPOSURE_ABSOLUTE, 0, 0}},
    {"white_balance_automatic", {V4L2_CID_AUTO_WHITE_BALANCE, 0, 0}},
};

std::vector<std::string> read_menu(const DeviceFile& file, const v4l2_queryctrl& query) {
  std::vector<std::string> items;
  if (query.type != V4L2_CTRL_TYPE_MENU) return items;
  for (std::int32_t i = query.minimum; i <= query.maximum && items.size() < 64; ++i) {
    v4l2_querymenu item{};
    item.id = query.id;
    item.index = static_cast<std::uint32_t>(i);
    if (file.control(VIDIOC_QUERYMENU, &item) != 0) continue;
    const char* text = reinterpret_cast<const char*>(item.name);
    items.push_back(std::to_string(i) + ": " + std::string(text, ::strnlen(text, 32)));
  }
  return items;
}

ControlInfo to_info(const DeviceFile& file, const v4l2_queryctrl& query) {
  ControlInfo info;
  const char* label = reinterpret_cast<const char*>(query.name);
  info.name = control_name(std::string(label, ::strnlen(label, sizeof query.name)));
  info.id = query.id;
  info.type = query.type;
  info.least = query.minimum;
  info.most = query.maximum;
  info.step = query.step;
  info.preset = query.default_value;
  info.read_only = (query.flags & V4L2_CTRL_FLAG_READ_ONLY) != 0;
  info.inactive = (query.flags & V4L2_CTRL_FLAG_INACTIVE) != 0;
  info.menu = read_menu(file, query);
  const auto value = read_control(file, query.id);
  info.value = value ? *value : info.preset;
  return info;
}

bool has_value(std::uint32_t type) {
  return type == V4L2_CTRL_TYPE_INTEGER || type == V4L2_CTRL_TYPE_BOOLEAN ||
         type == V4L2_CTRL_TYPE_MENU || type == V4L2_CTRL_TYPE_INTEGER_MENU ||
         type == V4L2_CTRL_TYPE_BITMASK || type == V4L2_CTRL_TYPE_BUTTON;
}

Error unknown_control(const std::vector<ControlInfo>& controls, const std::string& name) {
  std::vector<std::string> names;
  std::string all;
  for (const ControlInfo& control : controls) {
    names.push_back(control.name);
    all += (all.empty() ? "" : ", ") + control.name;
  }
  const std::string near = nearest_word(name, names);
  return Error{"this camera has no control '" + name + "'" +
               (near.empty() ? "" : "; did you mean '" + near + "'?") + " It has: " + all};
}

Result<void> write_control(const DeviceFile& file, const ControlInfo& control, std::int64_t value) {
  if (value < control.least || value > control.most) {
    return Error{control.name + "=" + std::to_string(value) + ": must be " +
                 std::to_string(control.least) + " to " + std::to_string(control.most)};
  }
  v4l2_control set{control.id, static_cast<std::int32_t>(value)};
  if (file.control(VIDIOC_S_CTRL, &set) != 0) {
    return Error{control.name + "=" + std::to_string(value) + ": refused: " + errno_text()};
  }
  if (control.type == V4L2_CTRL_TYPE_BUTTON) return {};
  const auto now = read_control(file, control.id);
  if (now && *now != value) {
    return Error{control.name + "=" + std::to_string(value) + ": the camera made it " +
                 std::to_string(*now)};
  }
  return {};
}

/// A camera that chooses its exposure itself ignores ours, or refuses it.
Result<void> take_exposure_over(const DeviceFile& file, const std::vector<ControlInfo>& controls,
                                const std::vector<ControlSetting>& settings) {
  const ControlInfo* automatic = find_control(controls, "auto_exposure");
  if (automatic == nullptr) return {};
  bool by_hand = false;
  for (const ControlSetting& setting : settings) {
    const ControlInfo* control = find_control(controls, setting.name);
    if (control == automatic) return {};  // the user says himself
    by_hand |= control != nullptr && control == find_control(controls, "exposure");
  }
  return by_hand ? write_control(file, *automatic, V4L2_EXPOSURE_MANUAL) : Result<void>();
}

}  // namespace

Result<std::vector<ControlSetting>> parse_controls(const std::vector<std::string>& texts) {
  std::vector<ControlSetting> settings;
  for (const std::string& text : texts) {
    const auto equals = text.find('=');
    const std::string_view value =
        equals == std::string::npos ? "" : trim(std::string_view(text).substr(equals + 1));
    const auto number = parse_integer(value);
    const std::string_view name = trim(std::string_view(text).substr(0, equals));
    if (!number || name.empty()) {
      return Error{"control '" + excerpt(text) +
                   "' must be NAME=WHOLE NUMBER; `sovo camera list` "
                   "shows names and ranges"};
    }
    settings.push_back({std::string(name), *number});
  }
  return settings;
}

std::string control_name(const std::string& label) {
  std::string name;
  for (const char c : label) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0) {
      name.push_back(static_cast<char>(std::tolower(byte)));
    } else if (!name.empty() && name.back() != '_') {
      name.push_back('_');
    }
  }
  while (!name.empty() && name.back() == '_') name.pop_back();
  return name;
}

std::vector<ControlInfo> list_controls(const DeviceFile& file) {
  std::vector<ControlInfo> controls;
  v4l2_queryctrl query{};
  query.id = V4L2_CTRL_FLAG_NEXT_CTRL;
  while (file.control(VIDIOC_QUERYCTRL, &query) == 0) {
    if ((query.flags & V4L2_CTRL_FLAG_DISABLED) == 0 && has_value(query.type)) {
      controls.push_back(to_info(file, query));
    }
    query.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
  }
  return controls;
}

const ControlInfo* find_control(const std::vector<ControlInfo>& controls, const std::string& name) {
  const auto by_name = std::find_if(controls.begin(), controls.end(),
                                    [&name](const ControlInfo& c) { return c.name == name; });
  if (by_name != controls.end()) return &*by_name;
  for (const Alias& alias : kAliases) {
    if (name != alias.name) continue;
    for (const std::uint32_t id : alias.ids) {
      const auto by_id = std::find_if(controls.begin(), controls.end(),
                                      [id](const ControlInfo& c) { return c.id == id; });
      if (by_id != controls.end()) return &*by_id;
    }
  }
  return nullptr;
}

Result<void> apply_controls(const DeviceFile& file, const std::vector<ControlSetting>& settings) {
  const auto controls = list_controls(file);
  std::string problems;
  const auto check = [&problems](const Result<void>& done) {
    if (!done) problems += (problems.empty() ? "" : "; ") + done.error();
  };
  check(take_exposure_over(file, controls, settings));
  for (const ControlSetting& setting : settings) {
    const ControlInfo* control = find_control(controls, setting.name);
    check(control == nullptr ? Result<void>(unknown_control(controls, setting.name))
                             : write_control(file, *control, setting.value));
  }
  if (!problems.empty()) return Error{problems};
  return {};
}

Result<std::int64_t> read_control(const DeviceFile& file, std::uint32_t id) {
  v4l2_control get{id, 0};
  if (file.control(VIDIOC_G_CTRL, &get) != 0) return Error{errno_text()};
  return std::int64_t{get.value};
}

}  // namespace sovo::v4l2
