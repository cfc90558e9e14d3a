#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sovo/driver/live/colour.h"
#include "sovo/image/stereo_frame.h"
#include "sovo/io/result.h"

namespace sovo {

/// What came of waiting for an image.
enum class CaptureState {
  kImage,    ///< One came.
  kNone,     ///< None came in time.
  kDamaged,  ///< One came that the device or its driver calls damaged, or that cannot be decoded.
  kShort,    ///< One came that has too few bytes.
  kNoRoom,   ///< One came, but all buffers are still in use.
  kGone,     ///< The device is lost: it must be opened anew.
};

/// An image as a device gives it.
struct Capture {
  std::int64_t device_ns = 0;        ///< Mid-exposure by the device's clock.
  std::int64_t clock_device_ns = 0;  ///< A reading of the device's clock and of UTC, the latter
  std::int64_t clock_utc_ns = 0;     ///< the same moment or later.
  bool shared_clock = false;         ///< The device's clock is one with the other's, by PTP.
  std::uint64_t skipped = 0;         ///< Images that the device made and lost since the last one.
  SideImage image;
  SideImage right;           ///< Of a device that gives both sides at once; else not valid.
  ColourImage colour;        ///< Of `image`, while somebody wants it and the device has it.
  ColourImage right_colour;  ///< Of `right`.
  std::string problem;       ///< For people, with a state other than kImage and kNone.
};

/// How much light a camera takes.
struct Exposure {
  double exposure_s = 0.0;
  double gain_db = 0.0;
};

/// A camera that is open and streams.
class CaptureDevice {
 public:
  virtual ~CaptureDevice() = default;

  /// Waits for the next image, at most `timeout`; `capture` is overwritten.
  virtual CaptureState next(std::chrono::milliseconds timeout, Capture* capture) = 0;

  /// Sets exposure and gain, as near as the device can.
  virtual Result<void> set_exposure(const Exposure&) {
    return Error{"this camera's exposure cannot be set"};
  }

  /// Temperature of the sensor [deg C], where offered.
  virtual std::optional<double> temperature() { return std::nullopt; }

  /// Counters of the driver's own, by name, for diagnostics; asked for once a second.
  virtual std::vector<std::pair<std::string, std::string>> counters() { return {}; }

  /// What is open: device and mode, for people.
  virtual std::string description() const = 0;
};

}  // namespace sovo
