#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sovo/driver/live/capture_device.h"
#include "sovo/driver/live/colour.h"
#include "sovo/driver/live/image_pool.h"
#include "sovo/driver/live/luma.h"
#include "sovo/driver/v4l2/controls.h"
#include "sovo/driver/v4l2/v4l2_file.h"
#include "sovo/driver/v4l2/v4l2_options.h"

struct v4l2_buffer;  // linux/videodev2.h

namespace sovo::v4l2 {

/// The mode that a device was set to.
struct StreamMode {
  CameraFormat format = CameraFormat::kYuyv;
  int width = 0;            ///< [px]
  int height = 0;           ///< [px]
  int stride = 0;           ///< Bytes from one row to the next.
  double frame_rate = 0.0;  ///< [Hz]; 0 when the driver does not say.
};

std::string to_string(const StreamMode& mode);

/// Sets the mode that the options ask for. The error lists the modes that there are.
Result<StreamMode> set_mode(const DeviceFile& file, const V4l2Options& options);

/// Memory of a camera's images, a pool a side, kept over reconnections.
struct CapturePools {
  ImagePool left;
  ImagePool right;  ///< Empty for a device of one side.
};

/// How a device's images are taken.
struct CaptureOptions {
  V4l2Options v4l2;
  bool side_by_side = true;
  std::shared_ptr<CapturePools> pools;
  ColourWanted colour_wanted;
  int width = 0;  ///< Of the calibrated image, a side of it [px]; another one is refused.
  int height = 0;
};

/// Refuses a mode that the calibration is not for.
Result<void> check_size(const StreamMode& mode, const CaptureOptions& options);

/// Buffers of the kernel that are mapped into this process; unmapped with the object.
class MappedBuffers {
 public:
  static Result<MappedBuffers> map(const DeviceFile& file, int count);

  MappedBuffers(MappedBuffers&& other) noexcept = default;
  MappedBuffers& operator=(MappedBuffers&& other) noexcept = default;
  ~MappedBuffers();

  std::size_t size() const { return buffers_.size(); }
  std::span<const std::uint8_t> operator[](std::size_t i) const { return buffers_[i]; }

 private:
  MappedBuffers() = default;
  std::vector<std::span<std::uint8_t>> buffers_;
};

/// A V4L2 device that streams: memory-mapped buffers, poll, stamps of CLOCK_MONOTONIC.
class V4l2Capture : public CaptureDevice {
 public:
  /// Opens the device, sets mode and controls, and starts the stream.
  static Result<std::unique_ptr<CaptureDevice>> open(const std::string& path,
                                                     const CaptureOptions& options);
  ~V4l2Capture() override;
  V4l2Capture(const V4l2Capture&) = delete;
  V4l2Capture& operator=(const V4l2Capture&) = delete;

  CaptureState next(std::chrono::milliseconds timeout, Capture* capture) override;
  Result<void> set_exposure(const Exposure& exposure) override;
  std::vector<std::pair<std::string, std::string>> counters() override;
  std::string description() const override;

 private:
  V4l2Capture(std::string path, DeviceFile file, MappedBuffers buffers, const StreamMode& mode,
              CaptureOptions options);

  Result<void> start();
  CaptureState wait(std::chrono::milliseconds timeout, Capture* capture);
  CaptureState read(const v4l2_buffer& taken, Capture* capture);
  void keep_colour(const RawImage& raw, Capture* capture);
  void fill_times(const v4l2_buffer& taken, Capture* capture);
  void update_exposure();
  CaptureState gone(Capture* capture) const;

  std::string path_;
  DeviceFile file_;
  MappedBuffers buffers_;
  StreamMode mode_;
  CaptureOptions options_;
  LumaReader luma_;
  ColourKeeper colour_;
  std::vector<ControlInfo> controls_;
  bool streaming_ = false;
  std::optional<std::uint32_t> last_sequence_;
  double exposure_s_ = 0.0;
  int images_until_exposure_ = 0;  ///< Until the control is read again.
};

}  // namespace sovo::v4l2
