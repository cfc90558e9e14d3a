#include "sovo/driver/aravis/gige_control.h"

#include <cmath>

#include "sovo/driver/aravis/features.h"
#include "sovo/driver/live/host_clock.h"

namespace sovo::aravis {
namespace {

constexpr std::int64_t kPromptNs = 5'000'000;  // a slower answer says too little of the time
constexpr int kReadings = 3;

using Counters = std::vector<std::pair<std::string, std::string>>;

std::uint64_t tick_frequency(ArvDevice* device) {
  Problem problem;
  const guint64 hertz =
      arv_gv_device_get_timestamp_tick_frequency(ARV_GV_DEVICE(device), problem.slot());
  return problem || hertz == 0 ? 1'000'000'000 : hertz;
}

}  // namespace

GigeControl::GigeControl(ArvCamera* camera, bool ptp)
    : camera_(camera),
      device_(arv_camera_get_device(camera)),
      latch_(first_feature(device_, {"TimestampLatch", "GevTimestampControlLatch"})),
      latched_(first_feature(device_, {"TimestampLatchValue", "GevTimestampValue"})),
      ptp_status_(ptp ? first_feature(device_, {"PtpStatus", "GevIEEE1588Status"}) : nullptr),
      ptp_latch_(ptp ? first_feature(device_, {"PtpDataSetLatch", "GevIEEE1588DataSetLatch"})
                     : nullptr),
      ptp_offset_(ptp ? first_feature(device_, {"PtpOffsetFromMaster"}) : nullptr),
      temperature_(first_feature(device_, {"DeviceTemperature", "DeviceTemperatureAbs"})),
      gain_in_db_(ARV_IS_GC_FLOAT(arv_device_get_feature(device_, "Gain")) != FALSE),
      tick_hz_(tick_frequency(device_)) {}

void GigeControl::update() {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock) return;
  read_clock();
  read_exposure();
  read_ptp();
  read_temperature();
}

void GigeControl::read_exposure() {
  Problem problem;
  const double microseconds = arv_camera_get_exposure_time(camera_, problem.slot());
  if (!problem) state_.exposure.exposure_s = 1e-6 * microseconds;
  if (!gain_in_db_) return;
  const double gain = arv_camera_get_gain(camera_, problem.slot());
  if (!problem) state_.exposure.gain_db = gain;
}

/// The promptest of a few readings; none when all were slow, and the last one stays.
void GigeControl::read_clock() {
  if (latch_ == nullptr || latched_ == nullptr) return;
  std::int64_t least = kPromptNs;
  for (int i = 0; i < kReadings; ++i) {
    Problem problem;
    const HostClock before = read_host_clock();
    arv_device_execute_command(device_, latch_, problem.slot());
    if (problem) return;
    const HostClock after = read_host_clock();
    const gint64 ticks = arv_device_get_integer_feature_value(device_, latched_, problem.slot());
    if (problem) return;
    const std::int64_t took = after.monotonic_ns - before.monotonic_ns;
    if (took >= least) continue;
    least = took;
    // The request arrived half way on average; that cannot be late by more than it took.
    state_.clock =
        ClockReading{to_ns(ticks), after.utc_ns - took / 2, after.monotonic_ns - took / 2};
    offset_ = state_.clock->device_ns - state_.clock->monotonic_ns;
  }
}

void GigeControl::read_ptp() {
  if (ptp_status_ == nullptr) return;
  Problem problem;
  if (ptp_latch_ != nullptr) arv_device_execute_command(device_, ptp_latch_, problem.slot());
  state_.ptp_status =
      to_text(arv_device_get_string_feature_value(device_, ptp_status_, problem.slot()));
  state_.ptp_locked = state_.ptp_status == "Slave" || state_.ptp_status == "Master";
  if (ptp_offset_ == nullptr) return;
  const gint64 offset = arv_device_get_integer_feature_value(device_, ptp_offset_, problem.slot());
  if (!problem) state_.ptp_offset_ns = offset;
}

void GigeControl::read_temperature() {
  if (temperature_ == nullptr) return;
  Problem problem;
  const double celsius = arv_device_get_float_feature_value(device_, temperature_, problem.slot());
  if (!problem) state_.temperature_c = celsius;
}

Result<void> GigeControl::set_exposure(const Exposure& exposure) {
  const std::scoped_lock lock(mutex_);
  Problem problem;
  if (!exposure_is_ours_) {
    // Cameras without an automatic one have nothing to turn off.
    arv_camera_set_exposure_time_auto(camera_, ARV_AUTO_OFF, problem.slot());
    arv_camera_set_gain_auto(camera_, ARV_AUTO_OFF, problem.slot());
    exposure_is_ours_ = true;
  }
  arv_camera_set_exposure_time(camera_, 1e6 * exposure.exposure_s, problem.slot());
  if (problem) return Error{"exposure: " + problem.text()};
  if (gain_in_db_) {
    arv_camera_set_gain(camera_, exposure.gain_db, problem.slot());
    if (problem) return Error{"gain: " + problem.text()};
  }
  read_exposure();
  return {};
}

std::int64_t GigeControl::to_ns(std::int64_t ticks) const {
  if (tick_hz_ == 1'000'000'000) return ticks;
  const auto hertz = static_cast<std::int64_t>(tick_hz_);
  const std::int64_t whole = ticks / hertz * 1'000'000'000;
  const double rest = 1e9 * static_cast<double>(ticks % hertz) / static_cast<double>(hertz);
  return whole + std::llround(rest);
}

void GigeControl::software_trigger() {
  const std::scoped_lock lock(mutex_);
  Problem problem;
  arv_device_execute_command(device_, "TriggerSoftware", problem.slot());
  ++(problem ? trigger_failures_ : triggers_);
}

void GigeControl::append_counters(Counters* counters) const {
  if (triggers_ + trigger_failures_ > 0) {
    counters->emplace_back("triggers", std::to_string(triggers_));
    counters->emplace_back("trigger_failures", std::to_string(trigger_failures_));
  }
  if (ptp_status_ == nullptr) return;
  counters->emplace_back("ptp_status", state_.ptp_status);
  if (state_.ptp_offset_ns) {
    counters->emplace_back("ptp_offset_ns", std::to_string(*state_.ptp_offset_ns));
  }
}

ChunkReader::ChunkReader(ArvCamera* camera, const ChunkUse& use)
    : parser_(arv_camera_create_chunk_parser(camera)), use_(use) {}

std::optional<std::int64_t> ChunkReader::stamp(ArvBuffer* buffer) const {
  if (!use_.stamp || arv_buffer_has_chunks(buffer) == FALSE) return std::nullopt;
  Problem problem;
  const gint64 ticks =
      arv_chunk_parser_get_integer_value(parser_.get(), buffer, "ChunkTimestamp", problem.slot());
  if (problem) return std::nullopt;
  return ticks;
}

std::optional<double> ChunkReader::exposure_s(ArvBuffer* buffer) const {
  if (!use_.exposure || arv_buffer_has_chunks(buffer) == FALSE) return std::nullopt;
  Problem problem;
  const double microseconds =
      arv_chunk_parser_get_float_value(parser_.get(), buffer, "ChunkExposureTime", problem.slot());
  if (problem || !(microseconds >= 0.0)) return std::nullopt;
  return 1e-6 * microseconds;
}

void ActionSender::send(std::int64_t time_ns) {
  socket_.send_action(kActionKeys, static_cast<std::uint64_t>(time_ns));
  const std::scoped_lock lock(mutex_);
  counts_ = socket_.counts();
}

void ActionSender::append_counters(Counters* counters) const {
  const std::scoped_lock lock(mutex_);
  counters->emplace_back("actions_sent", std::to_string(counts_.sent));
  counters->emplace_back("actions_accepted", std::to_string(counts_.accepted));
  counters->emplace_back("actions_late", std::to_string(counts_.late));
  counters->emplace_back("actions_without_ptp", std::to_string(counts_.no_time));
  counters->emplace_back("actions_refused", std::to_string(counts_.refused));
}

}  // namespace sovo::aravis
