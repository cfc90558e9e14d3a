#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sovo/driver/live/stereo_pairer.h"

namespace sovo {

enum class CameraState {
  kOpening,    ///< Not seen yet.
  kStreaming,  ///< Images come.
  kLost,       ///< It was there and is looked for.
};

const char* to_string(CameraState state);

/// What became of a device's images; all rise from the start of the process.
struct CameraCounts {
  std::uint64_t images = 0;         ///< Good ones.
  std::uint64_t skipped = 0;        ///< Gaps in the device's numbering.
  std::uint64_t damaged = 0;        ///< Flagged by the driver, or not to be decoded.
  std::uint64_t short_images = 0;   ///< Too few bytes.
  std::uint64_t no_room = 0;        ///< No free buffer: the process is too slow.
  std::uint64_t stalls = 0;         ///< Silences that made us open the device anew.
  std::uint64_t disconnects = 0;    ///< The device went away.
  std::uint64_t reconnects = 0;     ///< Images came again after a loss.
  std::uint64_t open_failures = 0;  ///< Attempts that failed.
  std::uint64_t clock_steps = 0;    ///< A clock was set.

  /// Images that were made and did not arrive whole.
  std::uint64_t dropped() const { return skipped + damaged + short_images + no_room; }
};

/// How one device is doing.
struct CameraReport {
  std::string name;
  std::string device;  ///< What is open, or was last.
  CameraState state = CameraState::kOpening;
  std::string message;  ///< Why it does not stream; empty when it does.
  CameraCounts counts;
  double rate_hz = 0.0;        ///< Of the images, over the last seconds.
  double clock_drift = 0.0;    ///< Seconds that UTC gains on the device a second.
  double clock_sigma_s = 0.0;  ///< Of the stamps.
  double downtime_s = 0.0;     ///< Length of the last loss.
  std::optional<double> temperature_c;
  /// Further counters of the driver, by name; empty when it has none.
  std::vector<std::pair<std::string, std::string>> stream;
};

/// How a stereo camera is doing.
struct LiveReport {
  std::vector<CameraReport> cameras;  ///< One that gives both sides, or left and right.
  PairerCounts pairs;                 ///< Zero for one device.
  std::uint64_t frames = 0;           ///< Given to the caller.
  std::uint64_t queue_dropped = 0;    ///< Frames that the caller was too slow for.
  double pair_error_s = 0.0;          ///< Of the newest pair.
  double exposure_s = 0.0;            ///< Of the newest left image; 0 when unknown.
  double gain_db = 0.0;
  double mean_grey = 0.0;  ///< Of the newest frame, when exposure is controlled.
};

}  // namespace sovo
