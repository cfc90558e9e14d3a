#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

namespace sovo::v4l2 {

/// Pixel format that is asked for.
enum class FormatWish { kAuto, kYuyv, kUyvy, kGrey, kNv12, kMjpg };

constexpr std::array<std::pair<FormatWish, const char*>, 6> enum_names(FormatWish) {
  return {{{FormatWish::kAuto, "auto"},
           {FormatWish::kYuyv, "YUYV"},
           {FormatWish::kUyvy, "UYVY"},
           {FormatWish::kGrey, "GREY"},
           {FormatWish::kNv12, "NV12"},
           {FormatWish::kMjpg, "MJPG"}}};
}

/// Which V4L2 cameras, and how.
struct V4l2Options {
  std::string device;  ///< One device that gives both sides; see `find_device`.
  std::string left;    ///< With `right`: two devices instead.
  std::string right;
  int width = 0;            ///< Of the device's image, both sides together [px]; 0: its own.
  int height = 0;           ///< [px]
  double frame_rate = 0.0;  ///< [Hz]; 0: its own.
  FormatWish format = FormatWish::kAuto;
  int buffers = 6;                    ///< Of the kernel's queue, at least 4.
  std::vector<std::string> controls;  ///< "name=value"
  double exposure_ms = 0.0;           ///< Where the camera does not tell [ms].
  double stamp_offset_ms = 0.0;       ///< Added to the stamps [ms].

  bool two_devices() const { return !left.empty() || !right.empty(); }

  template <class Visitor>
  void visit(Visitor& v) {
    v("device", device, "path, by-id name, serial number or USB port; empty: the only camera");
    v("left", left, "with right: two devices instead of one with both sides in its image");
    v("right", right, "the right device");
    v("width", width, "of the device's image, both sides together [px]; 0: its own");
    v("height", height, "of the device's image [px]; 0: its own");
    v("frame_rate", frame_rate, "images a second [Hz]; 0: its own");
    v("format", format, "pixel format; auto: the first that the camera has of these");
    v("buffers", buffers, "in the kernel's queue, 4 to 32");
    v("controls", controls, "camera controls, [name=value, ...]; `sovo camera list` shows them");
    v("exposure_ms", exposure_ms, "exposure where the camera does not tell it [ms]");
    v("stamp_offset_ms", stamp_offset_ms, "added to the stamps, e.g. minus the read-out [ms]");
  }
};

}  // namespace sovo::v4l2
