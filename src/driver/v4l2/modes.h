#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sovo/driver/live/luma.h"
#include "sovo/driver/v4l2/v4l2_file.h"

namespace sovo::v4l2 {

/// A size and pixel format that a device offers.
struct Mode {
  int width = 0;              ///< [px]
  int height = 0;             ///< [px]
  std::string format;         ///< As the driver spells it, e.g. "YUYV".
  std::vector<double> rates;  ///< [Hz], falling; empty when the driver does not say.
};

/// All modes of a device.
std::vector<Mode> list_modes(const DeviceFile& file);

/// V4L2's number of a format that we read.
std::uint32_t fourcc(CameraFormat format);
/// The format of that number; nothing when we do not read it.
std::optional<CameraFormat> camera_format(std::uint32_t fourcc);
std::string fourcc_text(std::uint32_t fourcc);

}  // namespace sovo::v4l2
