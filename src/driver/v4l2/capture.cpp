#include "sovo/driver/v4l2/capture.h"

#include <linux/videodev2.h>
#include <poll.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "sovo/driver/live/host_clock.h"
#include "sovo/driver/v4l2/zed_controls.h"

namespace sovo::v4l2 {
namespace {

constexpr int kExposureEvery = 60;                 // images; reading it is a transfer on the bus
constexpr double kExposureUnit = 100e-6;           // of V4L2_CID_EXPOSURE_ABSOLUTE [s]
constexpr std::int64_t kOldestNs = 1'000'000'000;  // of a stamp of an unnamed clock

v4l2_buffer make_buffer(std::uint32_t index) {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

std::int64_t to_ns(const timeval& time) {
  return std::int64_t{time.tv_sec} * 1'000'000'000 + std::int64_t{time.tv_usec} * 1'000;
}

}  // namespace

Result<void> check_size(const StreamMode& mode, const CaptureOptions& options) {
  const int width = options.side_by_side ? mode.width / 2 : mode.width;
  if (width == options.width && mode.height == options.height) return {};
  const int wanted = options.side_by_side ? 2 * options.width : options.width;
  return Error{"gives " + to_string(mode) + ", but the calibration is for images of " +
               std::to_string(options.width) + "x" + std::to_string(options.height) +
               "; ask for --size " + std::to_string(wanted) + "x" + std::to_string(options.height) +
               ", or give the calibration of this mode"};
}

Result<MappedBuffers> MappedBuffers::map(const DeviceFile& file, int count) {
  v4l2_requestbuffers request{};
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  request.count = static_cast<std::uint32_t>(count);
  if (file.control(VIDIOC_REQBUFS, &request) != 0) {
    return Error{errno == EBUSY ? "another program streams from this camera; end it"
                                : "no buffers: " + errno_text()};
  }
  if (request.count < 2) return Error{"the driver gives too few buffers"};
  MappedBuffers mapped;
  for (std::uint32_t i = 0; i < request.count; ++i) {
    v4l2_buffer buffer = make_buffer(i);
    if (file.control(VIDIOC_QUERYBUF, &buffer) != 0) return Error{"no buffer: " + errno_text()};
    void* memory = ::mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, file.fd(),
                          static_cast<off_t>(buffer.m.offset));
    if (memory == MAP_FAILED) return Error{"a buffer cannot be mapped: " + errno_text()};
    mapped.buffers_.emplace_back(static_cast<std::uint8_t*>(memory), buffer.length);
  }
  return mapped;
}

MappedBuffers::~MappedBuffers() {
  for (const auto& buffer : buffers_) ::munmap(buffer.data(), buffer.size());
}

Result<std::unique_ptr<CaptureDevice>> V4l2Capture::open(const std::string& path,
                                                         const CaptureOptions& options) {
  const auto problem = [&path](const Error& error) { return Error{path + ": " + error.message}; };
  auto file = DeviceFile::open(path);
  if (!file) return file.failure();
  const auto mode = set_mode(*file, options.v4l2);
  if (!mode) return problem(mode.failure());
  if (auto fits = check_size(*mode, options); !fits) return problem(fits.failure());
  auto buffers = MappedBuffers::map(*file, options.v4l2.buffers);
  if (!buffers) return problem(buffers.failure());
  std::unique_ptr<V4l2Capture> capture(
      new V4l2Capture(path, std::move(*file), std::move(*buffers), *mode, options));
  if (auto started = capture->start(); !started) return problem(started.failure());
  return std::unique_ptr<CaptureDevice>(std::move(capture));
}

V4l2Capture::V4l2Capture(std::string path, DeviceFile file, MappedBuffers buffers,
                         const StreamMode& mode, CaptureOptions options)
    : path_(std::move(path)),
      file_(std::move(file)),
      buffers_(std::move(buffers)),
      mode_(mode),
      options_(std::move(options)),
      colour_(options_.colour_wanted) {}

V4l2Capture::~V4l2Capture() {
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (streaming_) file_.control(VIDIOC_STREAMOFF, &type);
}

Result<void> V4l2Capture::start() {
  const auto settings = parse_controls(options_.v4l2.controls);
  if (!settings) return settings.failure();
  if (auto set = apply_settings(file_, mode_.frame_rate, *settings); !set) return set;
  controls_ = list_controls(file_);
  for (std::uint32_t i = 0; i < buffers_.size(); ++i) {
    v4l2_buffer buffer = make_buffer(i);
    if (file_.control(VIDIOC_QBUF, &buffer) != 0) {
      return Error{"a buffer is refused: " + errno_text()};
    }
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (file_.control(VIDIOC_STREAMON, &type) != 0) {
    return Error{errno == ENOSPC ? "the USB bus has no bandwidth left for this mode; plug the "
                                   "camera into a controller of its own, or take a smaller mode"
                                 : "the stream cannot be started: " + errno_text()};
  }
  streaming_ = true;
  return {};
}

CaptureState V4l2Capture::gone(Capture* capture) const {
  capture->problem = path_ + ": " + (errno == ENODEV ? "the camera went away" : errno_text());
  return CaptureState::kGone;
}

CaptureState V4l2Capture::wait(std::chrono::milliseconds timeout, Capture* capture) {
  pollfd poll{file_.fd(), POLLIN, 0};
  const int ready = ::poll(&poll, 1, static_cast<int>(timeout.count()));
  if (ready == 0 || (ready < 0 && errno == EINTR)) return CaptureState::kNone;
  if (ready < 0) return gone(capture);
  // With an error flag the driver may still have an image; the next call says what is wrong.
  return CaptureState::kImage;
}

CaptureState V4l2Capture::next(std::chrono::milliseconds timeout, Capture* capture) {
  *capture = {};
  if (const auto ready = wait(timeout, capture); ready != CaptureState::kImage) return ready;
  v4l2_buffer taken = make_buffer(0);
  if (file_.control(VIDIOC_DQBUF, &taken) != 0) {
    return errno == EAGAIN ? CaptureState::kNone : gone(capture);
  }
  if (taken.index >= buffers_.size()) {
    capture->problem = path_ + ": the driver gave a buffer that there is not";
    return CaptureState::kGone;
  }
  if (last_sequence_) capture->skipped = taken.sequence - *last_sequence_ - 1U;
  // A driver that starts its numbers anew lost nothing that could be counted.
  if (capture->skipped > 0x7fffffffU) capture->skipped = 0;
  last_sequence_ = taken.sequence;
  const CaptureState state = read(taken, capture);
  if (file_.control(VIDIOC_QBUF, &taken) != 0 && errno == ENODEV) return gone(capture);
  return state;
}

CaptureState V4l2Capture::read(const v4l2_buffer& taken, Capture* capture) {
  if ((taken.flags & V4L2_BUF_FLAG_ERROR) != 0) {
    capture->problem = path_ + ": the driver calls an image damaged";
    return CaptureState::kDamaged;
  }
  const auto whole = buffers_[taken.index];
  const RawImage raw{mode_.format, mode_.width, mode_.height, mode_.stride,
                     whole.first(std::min<std::size_t>(taken.bytesused, whole.size()))};
  const auto left = options_.pools->left.take();
  const auto right = options_.side_by_side ? options_.pools->right.take() : nullptr;
  if (!left || (options_.side_by_side && !right)) {
    capture->problem = path_ + ": no free buffer: this process is too slow for the camera";
    return CaptureState::kNoRoom;
  }
  const bool good = options_.side_by_side ? luma_.read_halves(raw, left->data(), right->data())
                                          : luma_.read(raw, left->data());
  if (!good) {
    capture->problem = path_ + ": " + luma_.problem();
    return raw.bytes.size() < expected_bytes(raw) ? CaptureState::kShort : CaptureState::kDamaged;
  }
  update_exposure();
  SideImage image;
  image.valid = true;
  image.width = options_.side_by_side ? mode_.width / 2 : mode_.width;
  image.height = mode_.height;
  image.step = image.width;
  image.exposure_s = static_cast<float>(exposure_s_);
  image.data = left;
  capture->image = image;
  if (options_.side_by_side) {
    image.data = right;
    capture->right = image;
  }
  keep_colour(raw, capture);
  fill_times(taken, capture);
  return CaptureState::kImage;
}

void V4l2Capture::keep_colour(const RawImage& raw, Capture* capture) {
  capture->colour = colour_.keep(raw);
  if (!options_.side_by_side || !capture->colour.bytes) return;
  capture->right_colour = capture->colour.half(true);
  capture->colour = capture->colour.half(false);
}

std::vector<std::pair<std::string, std::string>> V4l2Capture::counters() {
  return {{"colour_kept", std::to_string(colour_.kept())},
          {"colour_skipped", std::to_string(colour_.skipped())}};
}

void V4l2Capture::fill_times(const v4l2_buffer& taken, Capture* capture) {
  const HostClock now = read_host_clock();
  capture->clock_device_ns = now.monotonic_ns;
  capture->clock_utc_ns = now.utc_ns;
  std::int64_t stamp = to_ns(taken.timestamp);
  double offset = 1e-3 * options_.v4l2.stamp_offset_ms;
  const bool monotonic =
      (taken.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  // Drivers that do not say which clock it is mostly mean this one all the same.
  const bool recent = stamp > now.monotonic_ns - kOldestNs;
  const bool usable = stamp > 0 && stamp <= now.monotonic_ns && (monotonic || recent);
  const auto source = taken.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK;
  if (!usable) {
    // Of an unknown clock: the arrival is what is left.
    stamp = now.monotonic_ns;
    offset -= 0.5 * exposure_s_;
  } else {
    offset += source == V4L2_BUF_FLAG_TSTAMP_SRC_SOE ? 0.5 * exposure_s_ : -0.5 * exposure_s_;
  }
  capture->device_ns = stamp + static_cast<std::int64_t>(std::llround(1e9 * offset));
}

/// Exposure as the camera has it now, where it tells.
void V4l2Capture::update_exposure() {
  if (images_until_exposure_-- > 0) return;
  images_until_exposure_ = kExposureEvery;
  exposure_s_ = 1e-3 * options_.v4l2.exposure_ms;
  const ControlInfo* control = find_control(controls_, "exposure");
  if (control == nullptr || control->id != V4L2_CID_EXPOSURE_ABSOLUTE) return;
  if (const auto value = read_control(file_, control->id)) {
    exposure_s_ = kExposureUnit * static_cast<double>(*value);
  }
}

Result<void> V4l2Capture::set_exposure(const Exposure& exposure) {
  const ControlInfo* control = find_control(controls_, "exposure");
  if (control == nullptr || control->id != V4L2_CID_EXPOSURE_ABSOLUTE) {
    return Error{path_ + ": exposure cannot be controlled: the camera has no " +
                 "exposure_time_absolute; set camera.auto_exposure.enabled to false"};
  }
  const auto wanted = std::llround(exposure.exposure_s / kExposureUnit);
  const auto value = std::clamp<std::int64_t>(wanted, control->least, control->most);
  images_until_exposure_ = 0;
  return apply_controls(file_, {{control->name, value}});
}

std::string V4l2Capture::description() const { return path_ + " " + to_string(mode_); }

}  // namespace sovo::v4l2
