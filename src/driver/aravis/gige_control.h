#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sovo/driver/aravis/gige_setup.h"
#include "sovo/driver/live/capture_device.h"

namespace sovo::aravis {

/// A camera's clock and UTC at one moment.
struct ClockReading {
  std::int64_t device_ns = 0;
  std::int64_t utc_ns = 0;        ///< The same moment, or a little later.
  std::int64_t monotonic_ns = 0;  ///< As `utc_ns`, by CLOCK_MONOTONIC.
};

/// What a camera last said of itself.
struct CameraStateNow {
  Exposure exposure;                  ///< Zeros where it does not tell.
  std::optional<ClockReading> clock;  ///< Where the clock can be read.
  bool ptp_locked = false;            ///< The clock is set by PTP, or sets the others.
  std::string ptp_status;             ///< Empty without PTP.
  std::optional<std::int64_t> ptp_offset_ns;
  std::optional<double> temperature_c;
};

/// Talks to a camera while it streams. The capture thread calls everything but `software_trigger`
/// and `offset_from_monotonic`, which are for a trigger thread.
class GigeControl {
 public:
  GigeControl(ArvCamera* camera, bool ptp);

  /// Asks the camera anew; left out while a trigger is being sent. Some round trips.
  void update();
  const CameraStateNow& state() const { return state_; }

  Result<void> set_exposure(const Exposure& exposure);

  /// Nanoseconds of ticks of the camera's clock.
  std::int64_t to_ns(std::int64_t ticks) const;

  void software_trigger();
  /// The camera's clock less CLOCK_MONOTONIC [ns].
  std::int64_t offset_from_monotonic() const { return offset_; }

  void append_counters(std::vector<std::pair<std::string, std::string>>* counters) const;

 private:
  void read_exposure();
  void read_clock();
  void read_ptp();
  void read_temperature();

  ArvCamera* camera_;
  ArvDevice* device_;
  const char* latch_;  ///< Names of features; null where the camera has none.
  const char* latched_;
  const char* ptp_status_;
  const char* ptp_latch_;
  const char* ptp_offset_;
  const char* temperature_;
  bool gain_in_db_;
  std::uint64_t tick_hz_;
  bool exposure_is_ours_ = false;
  CameraStateNow state_;
  std::atomic<std::int64_t> offset_{0};
  std::atomic<std::uint64_t> triggers_{0};
  std::atomic<std::uint64_t> trigger_failures_{0};
  std::mutex mutex_;  ///< libaravis' tree of features is for one thread at a time.
};

/// Reads what an image brought along.
class ChunkReader {
 public:
  ChunkReader(ArvCamera* camera, const ChunkUse& use);

  /// Stamp of the image in ticks of the camera's clock.
  std::optional<std::int64_t> stamp(ArvBuffer* buffer) const;
  std::optional<double> exposure_s(ArvBuffer* buffer) const;

 private:
  Owned<ArvChunkParser> parser_;
  ChunkUse use_;
};

/// Sends action commands on a trigger's thread, and tells of them on others.
class ActionSender {
 public:
  explicit ActionSender(GvcpSocket socket) : socket_(std::move(socket)) {}

  void send(std::int64_t time_ns);
  void append_counters(std::vector<std::pair<std::string, std::string>>* counters) const;

 private:
  GvcpSocket socket_;
  mutable std::mutex mutex_;
  ActionCounts counts_;
};

}  // namespace sovo::aravis
