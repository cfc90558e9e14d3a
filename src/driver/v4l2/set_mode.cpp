#include <linux/videodev2.h>

#include <cmath>
#include <cstdio>

#include "sovo/driver/v4l2/capture.h"
#include "sovo/driver/v4l2/modes.h"
#include "sovo/io/text.h"

namespace sovo::v4l2 {
namespace {

std::string rate_text(double rate) { return format_double(std::round(100.0 * rate) / 100.0); }

std::string listing(const DeviceFile& file) {
  std::string text;
  for (const Mode& mode : list_modes(file)) {
    text += (text.empty() ? "; it has " : ", ") + std::to_string(mode.width) + "x" +
            std::to_string(mode.height) + " " + mode.format;
    for (std::size_t i = 0; i < mode.rates.size(); ++i) {
      text += (i == 0 ? "@" : "/") + rate_text(mode.rates[i]);
    }
  }
  return text;
}

Result<void> check_capabilities(const DeviceFile& file) {
  v4l2_capability capability{};
  if (file.control(VIDIOC_QUERYCAP, &capability) != 0) return Error{"is no video device"};
  const auto has = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps
                                                                         : capability.capabilities;
  if ((has & V4L2_CAP_VIDEO_CAPTURE) == 0 || (has & V4L2_CAP_STREAMING) == 0) {
    return Error{"gives no images; it is another node of the camera, or an output"};
  }
  return {};
}

CameraFormat wished(FormatWish wish) {
  switch (wish) {
    case FormatWish::kUyvy:
      return CameraFormat::kUyvy;
    case FormatWish::kGrey:
      return CameraFormat::kGrey;
    case FormatWish::kNv12:
      return CameraFormat::kNv12;
    case FormatWish::kMjpg:
      return CameraFormat::kMjpeg;
    case FormatWish::kAuto:
    case FormatWish::kYuyv:
      break;
  }
  return CameraFormat::kYuyv;
}

/// What is asked for, the first of the formats that is got.
bool try_format(const DeviceFile& file, const V4l2Options& options, FormatWish wish,
                v4l2_format* format) {
  format->type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (file.control(VIDIOC_G_FMT, format) != 0) return false;
  v4l2_pix_format& pix = format->fmt.pix;
  if (options.width > 0) pix.width = static_cast<std::uint32_t>(options.width);
  if (options.height > 0) pix.height = static_cast<std::uint32_t>(options.height);
  pix.pixelformat = fourcc(wished(wish));
  pix.field = V4L2_FIELD_NONE;
  pix.bytesperline = 0;
  pix.sizeimage = 0;
  const std::uint32_t width = pix.width;
  const std::uint32_t height = pix.height;
  return file.control(VIDIOC_S_FMT, format) == 0 && pix.pixelformat == fourcc(wished(wish)) &&
         (options.width == 0 || pix.width == width) &&
         (options.height == 0 || pix.height == height);
}

/// Asks for a rate; what the driver made of it, 0 when it does not say.
double set_rate(const DeviceFile& file, double rate) {
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (rate > 0.0) {
    parameters.parm.capture.timeperframe = {1000, static_cast<std::uint32_t>(1000.0 * rate + 0.5)};
    file.control(VIDIOC_S_PARM, &parameters);
  }
  if (file.control(VIDIOC_G_PARM, &parameters) != 0) return 0.0;
  const v4l2_fract& time = parameters.parm.capture.timeperframe;
  return time.numerator == 0 ? 0.0 : double(time.denominator) / double(time.numerator);
}

}  // namespace

std::string to_string(const StreamMode& mode) {
  return std::to_string(mode.width) + "x" + std::to_string(mode.height) + " " +
         to_string(mode.format) + (mode.frame_rate > 0.0 ? "@" + rate_text(mode.frame_rate) : "");
}

Result<StreamMode> set_mode(const DeviceFile& file, const V4l2Options& options) {
  if (auto able = check_capabilities(file); !able) return able.failure();
  std::vector<FormatWish> wishes{options.format};
  if (options.format == FormatWish::kAuto) {
    wishes = {FormatWish::kYuyv, FormatWish::kGrey, FormatWish::kNv12, FormatWish::kUyvy,
              FormatWish::kMjpg};
  }
  v4l2_format format{};
  bool got = false;
  for (auto wish = wishes.begin(); wish != wishes.end() && !got; ++wish) {
    got = try_format(file, options, *wish, &format);
  }
  if (!got) {
    const std::string size =
        options.width > 0 ? std::to_string(options.width) + "x" + std::to_string(options.height)
                          : "its size";
    return Error{"the camera does not give " + size + " in a format that is asked for" +
                 listing(file)};
  }
  const v4l2_pix_format& pix = format.fmt.pix;
  StreamMode mode;
  mode.format = camera_format(pix.pixelformat).value_or(CameraFormat::kYuyv);
  mode.width = static_cast<int>(pix.width);
  mode.height = static_cast<int>(pix.height);
  const int bytes =
      mode.format == CameraFormat::kYuyv || mode.format == CameraFormat::kUyvy ? 2 : 1;
  mode.stride = std::max(static_cast<int>(pix.bytesperline), bytes * mode.width);
  mode.frame_rate = set_rate(file, options.frame_rate);
  if (options.frame_rate > 0.0 && mode.frame_rate > 0.0 &&
      std::abs(mode.frame_rate - options.frame_rate) > 0.02 * options.frame_rate) {
    return Error{"the camera does not give " + rate_text(options.frame_rate) +
                 " Hz at this size, " + "but " + rate_text(mode.frame_rate) + listing(file)};
  }
  return mode;
}

}  // namespace sovo::v4l2
