#pragma once

#include <string>
#include <vector>

#include "sovo/driver/aravis/glib_owner.h"
#include "sovo/io/result.h"

namespace sovo::aravis {

/// A GenICam feature and the value that it shall have.
struct FeatureSetting {
  std::string name;
  std::string value;
};

/// "Name=value" texts; the error says which is none.
Result<std::vector<FeatureSetting>> parse_features(const std::vector<std::string>& texts);

/// Whether the camera has the feature, and it may be used now.
bool has_feature(ArvDevice* device, const char* name);
/// Whether an enumeration has the entry, and it may be used now.
bool has_entry(ArvDevice* device, const char* feature, const std::string& entry);

/// The first of `names` that the camera has; null when it has none.
const char* first_feature(ArvDevice* device, const std::vector<const char*>& names);

/// Sets a feature and reads it back; a command is executed. The error says what the camera made of
/// it, or what values there are.
Result<void> set_feature(ArvDevice* device, const FeatureSetting& setting);

}  // namespace sovo::aravis
