#include "sovo/driver/aravis/features.h"

#include <cmath>

#include "sovo/io/text.h"

namespace sovo::aravis {
namespace {

/// Cameras round; more than this is not what was asked for.
constexpr double kRounding = 0.01;

std::vector<std::string> entries_of(ArvDevice* device, const char* feature) {
  Problem problem;
  guint count = 0;
  const std::unique_ptr<const char*, MemoryDeleter> names(
      arv_device_dup_available_enumeration_feature_values_as_strings(device, feature, &count,
                                                                     problem.slot()));
  std::vector<std::string> entries;
  for (guint i = 0; names && i < count; ++i) entries.push_back(to_text(names.get()[i]));
  return entries;
}

Error mismatch(const FeatureSetting& setting, const std::string& made) {
  return Error{setting.name + "=" + setting.value + ": the camera made it " + made};
}

Result<void> set_enumeration(ArvDevice* device, const FeatureSetting& setting) {
  const char* name = setting.name.c_str();
  Problem problem;
  arv_device_set_string_feature_value(device, name, setting.value.c_str(), problem.slot());
  if (problem) {
    std::string known;
    for (const std::string& entry : entries_of(device, name)) known += " " + entry;
    return Error{setting.name + "=" + setting.value + ": " + problem.text() +
                 "; it may be:" + (known.empty() ? " nothing now" : known)};
  }
  const std::string made =
      to_text(arv_device_get_string_feature_value(device, name, problem.slot()));
  if (problem) return Error{setting.name + ": " + problem.text()};
  if (made != setting.value) return mismatch(setting, made);
  return {};
}

Result<void> set_boolean(ArvDevice* device, const FeatureSetting& setting) {
  const bool on = setting.value == "true" || setting.value == "1" || setting.value == "on";
  const bool off = setting.value == "false" || setting.value == "0" || setting.value == "off";
  if (!on && !off) return Error{setting.name + "=" + setting.value + ": it may be: true false"};
  Problem problem;
  arv_device_set_boolean_feature_value(device, setting.name.c_str(), on ? TRUE : FALSE,
                                       problem.slot());
  if (problem) return Error{setting.name + "=" + setting.value + ": " + problem.text()};
  const bool made =
      arv_device_get_boolean_feature_value(device, setting.name.c_str(), problem.slot()) != FALSE;
  if (problem) return Error{setting.name + ": " + problem.text()};
  if (made != on) return mismatch(setting, made ? "true" : "false");
  return {};
}

Result<void> set_number(ArvDevice* device, bool is_float, const FeatureSetting& setting) {
  const auto wanted = parse_double(setting.value);
  if (!wanted || (!is_float && *wanted != std::floor(*wanted))) {
    return Error{setting.name + "=" + setting.value + ": it must be a " +
                 (is_float ? "number" : "whole number")};
  }
  const char* name = setting.name.c_str();
  Problem problem;
  double made = 0.0;
  if (is_float) {
    arv_device_set_float_feature_value(device, name, *wanted, problem.slot());
    if (!problem) made = arv_device_get_float_feature_value(device, name, problem.slot());
  } else {
    arv_device_set_integer_feature_value(device, name, std::llround(*wanted), problem.slot());
    if (!problem) {
      made =
          static_cast<double>(arv_device_get_integer_feature_value(device, name, problem.slot()));
    }
  }
  if (problem) return Error{setting.name + "=" + setting.value + ": " + problem.text()};
  const double tolerance = is_float ? kRounding * std::abs(*wanted) + 1e-9 : 0.0;
  if (!(std::abs(made - *wanted) <= tolerance)) return mismatch(setting, format_double(made));
  return {};
}

Result<void> set_text(ArvDevice* device, const FeatureSetting& setting) {
  Problem problem;
  arv_device_set_string_feature_value(device, setting.name.c_str(), setting.value.c_str(),
                                      problem.slot());
  if (problem) return Error{setting.name + "=" + setting.value + ": " + problem.text()};
  const std::string made =
      to_text(arv_device_get_string_feature_value(device, setting.name.c_str(), problem.slot()));
  if (problem) return Error{setting.name + ": " + problem.text()};
  if (made != setting.value) return mismatch(setting, made);
  return {};
}

}  // namespace

Result<std::vector<FeatureSetting>> parse_features(const std::vector<std::string>& texts) {
  std::vector<FeatureSetting> settings;
  for (const std::string& text : texts) {
    const auto equals = text.find('=');
    const std::string_view view = text;
    if (equals == std::string::npos || trim(view.substr(0, equals)).empty()) {
      return Error{"feature '" + excerpt(text) + "' must be Name=value, e.g. ExposureTime=5000"};
    }
    settings.push_back(
        {std::string(trim(view.substr(0, equals))), std::string(trim(view.substr(equals + 1)))});
  }
  return settings;
}

bool has_feature(ArvDevice* device, const char* name) {
  Problem problem;
  return arv_device_is_feature_available(device, name, problem.slot()) != FALSE && !problem;
}

bool has_entry(ArvDevice* device, const char* feature, const std::string& entry) {
  if (!has_feature(device, feature)) return false;
  for (const std::string& known : entries_of(device, feature)) {
    if (known == entry) return true;
  }
  return false;
}

const char* first_feature(ArvDevice* device, const std::vector<const char*>& names) {
  for (const char* name : names) {
    if (has_feature(device, name)) return name;
  }
  return nullptr;
}

Result<void> set_feature(ArvDevice* device, const FeatureSetting& setting) {
  ArvGcNode* node = arv_device_get_feature(device, setting.name.c_str());
  if (ARV_IS_GC_FEATURE_NODE(node) == FALSE) {
    return Error{"this camera has no feature " + excerpt(setting.name) +
                 "; `arv-tool-0.8 features` of aravis-tools-cli lists them"};
  }
  if (ARV_IS_GC_ENUMERATION(node) != FALSE) return set_enumeration(device, setting);
  if (ARV_IS_GC_BOOLEAN(node) != FALSE) return set_boolean(device, setting);
  if (ARV_IS_GC_COMMAND(node) != FALSE) {
    Problem problem;
    arv_device_execute_command(device, setting.name.c_str(), problem.slot());
    if (problem) return Error{setting.name + ": " + problem.text()};
    return {};
  }
  if (ARV_IS_GC_STRING(node) != FALSE) return set_text(device, setting);
  return set_number(device, ARV_IS_GC_FLOAT(node) != FALSE, setting);
}

}  // namespace sovo::aravis
