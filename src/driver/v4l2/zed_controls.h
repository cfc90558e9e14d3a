#pragma once

#include <cstdint>
#include <vector>

#include "sovo/driver/v4l2/controls.h"
#include "sovo/driver/v4l2/extension_unit.h"
#include "sovo/io/result.h"

namespace sovo::v4l2 {

/// Exposure and gain of a ZED, which are behind a vendor extension of its UVC interface: registers
/// of its bridge and of its two sensors. Both sensors get the same. Written after Stereolabs' open
/// capture library; no ZED has seen it.
class ZedControls {
 public:
  static constexpr std::uint8_t kUnit = 4;
  static constexpr std::uint8_t kSelector = 2;

  /// `frame_rate` [Hz] limits the exposure.
  ZedControls(ExtensionUnit* unit, double frame_rate) : unit_(unit), frame_rate_(frame_rate) {}

  /// Exposure and gain as the camera likes, or as they are set.
  Result<void> set_automatic(bool automatic);
  /// Per cent of the longest exposure at the frame rate, 0 to 100; ends the automatic one.
  Result<void> set_exposure(int percent);
  /// Per cent of the largest gain, 0 to 100; ends the automatic one.
  Result<void> set_gain(int percent);

  /// The longest exposure at a frame rate [rows].
  static int longest_exposure(double frame_rate);
  /// Register value of a gain: four ranges, each of twice the gain of the one before.
  static int gain_register(int percent);

 private:
  struct Register {
    std::uint8_t task;  ///< How it is reached: the bridge's own, or a sensor's.
    std::uint32_t address;
  };
  static std::vector<std::uint8_t> message(bool write, const Register& at, std::size_t size);
  Result<std::uint8_t> read(const Register& at);
  /// Writes, and reads back.
  Result<void> write(const Register& at, std::uint8_t value);
  Result<void> write_sensors(std::uint32_t address, int value);

  ExtensionUnit* unit_;
  double frame_rate_;
};

/// Whether a setting is one of ZedControls: zed_auto_exposure (0 or 1), zed_exposure and zed_gain
/// (0 to 100).
bool is_zed_control(const ControlSetting& setting);

/// Sets them in order. The error names the control and what is wrong with it.
Result<void> apply_zed_controls(ZedControls* zed, const std::vector<ControlSetting>& settings);

/// Sets all controls of a camera: those of V4L2, and those of a ZED's extension.
Result<void> apply_settings(const DeviceFile& file, double frame_rate,
                            const std::vector<ControlSetting>& settings);

}  // namespace sovo::v4l2
