#include "sovo/driver/v4l2/modes.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <utility>

namespace sovo::v4l2 {
namespace {

constexpr std::pair<CameraFormat, std::uint32_t> kFormats[] = {
    {CameraFormat::kYuyv, V4L2_PIX_FMT_YUYV},   {CameraFormat::kUyvy, V4L2_PIX_FMT_UYVY},
    {CameraFormat::kGrey, V4L2_PIX_FMT_GREY},   {CameraFormat::kNv12, V4L2_PIX_FMT_NV12},
    {CameraFormat::kMjpeg, V4L2_PIX_FMT_MJPEG},
};
constexpr std::uint32_t kMostModes = 256;  // a driver that never ends its list must not hang us

std::vector<double> list_rates(const DeviceFile& file, std::uint32_t format, std::uint32_t width,
                               std::uint32_t height) {
  std::vector<double> rates;
  v4l2_frmivalenum interval{};
  interval.pixel_format = format;
  interval.width = width;
  interval.height = height;
  while (interval.index < kMostModes && file.control(VIDIOC_ENUM_FRAMEINTERVALS, &interval) == 0) {
    const v4l2_fract& time =
        interval.type == V4L2_FRMIVAL_TYPE_DISCRETE ? interval.discrete : interval.stepwise.min;
    if (time.numerator > 0) rates.push_back(double(time.denominator) / double(time.numerator));
    if (interval.type != V4L2_FRMIVAL_TYPE_DISCRETE) break;
    ++interval.index;
  }
  std::sort(rates.rbegin(), rates.rend());
  return rates;
}

void list_sizes(const DeviceFile& file, std::uint32_t format, std::vector<Mode>* modes) {
  v4l2_frmsizeenum size{};
  size.pixel_format = format;
  while (size.index < kMostModes && file.control(VIDIOC_ENUM_FRAMESIZES, &size) == 0) {
    const bool discrete = size.type == V4L2_FRMSIZE_TYPE_DISCRETE;
    const std::uint32_t width = discrete ? size.discrete.width : size.stepwise.max_width;
    const std::uint32_t height = discrete ? size.discrete.height : size.stepwise.max_height;
    modes->push_back({static_cast<int>(width), static_cast<int>(height), fourcc_text(format),
                      list_rates(file, format, width, height)});
    if (!discrete) break;
    ++size.index;
  }
}

}  // namespace

std::vector<Mode> list_modes(const DeviceFile& file) {
  std::vector<Mode> modes;
  v4l2_fmtdesc format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  while (format.index < kMostModes && file.control(VIDIOC_ENUM_FMT, &format) == 0) {
    list_sizes(file, format.pixelformat, &modes);
    ++format.index;
  }
  return modes;
}

std::uint32_t fourcc(CameraFormat format) {
  for (const auto& [known, number] : kFormats) {
    if (known == format) return number;
  }
  return 0;
}

std::optional<CameraFormat> camera_format(std::uint32_t fourcc) {
  for (const auto& [format, number] : kFormats) {
    if (number == fourcc) return format;
  }
  return std::nullopt;
}

std::string fourcc_text(std::uint32_t fourcc) {
  std::string text;
  for (int i = 0; i < 4; ++i) {
    const char c = static_cast<char>((fourcc >> (8 * i)) & 0x7fU);
    text.push_back(c >= ' ' && c <= '~' ? c : '?');
  }
  return text;
}

}  // namespace sovo::v4l2
