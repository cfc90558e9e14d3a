#include "sovo/driver/v4l2/zed_controls.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <string>
#include <thread>

namespace sovo::v4l2 {

namespace {

constexpr std::uint8_t kWrite = 0x50;
constexpr std::uint8_t kRead = 0x51;
constexpr std::uint8_t kBridge = 0xA2;
constexpr std::array<std::uint8_t, 2> kSensors = {0xA3, 0xA5};  // left, right
constexpr std::array<std::uint32_t, 2> kProcessors = {0x80181033, 0x80181833};
constexpr std::uint8_t kAutomatic = 0x02;    // of a processor's register
constexpr std::uint32_t kExposure = 0x3500;  // three bytes, the highest first, in 1/16 rows
constexpr std::uint32_t kGain = 0x3507;      // three bytes, the highest first
constexpr std::size_t kWriteAt = 16;         // the value's place in a message and in an answer
constexpr std::size_t kReadAt = 17;
constexpr int kShortestExposure = 2;              // [rows]
constexpr std::chrono::microseconds kPause(300);  // the camera's time for a message

struct LongestExposure {
  double frame_rate;
  int rows;
};
constexpr std::array<LongestExposure, 4> kLongest = {
    {{15.0, 1550}, {30.0, 1100}, {60.0, 880}, {100.0, 720}}};

/// Ranges of the sensors' gain register, both ends included.
struct GainRange {
  int first, last;
};
constexpr std::array<GainRange, 4> kGainRanges = {
    {{0, 255}, {378, 511}, {890, 1023}, {1914, 2047}}};

Result<void> check_percent(int percent) {
  if (percent >= 0 && percent <= 100) return {};
  return Error{"must be 0 to 100"};
}

}  // namespace

int ZedControls::longest_exposure(double frame_rate) {
  const auto faster = std::find_if(kLongest.begin(), kLongest.end(), [&](const auto& longest) {
    return frame_rate <= longest.frame_rate + 1.0;
  });
  return faster != kLongest.end() ? faster->rows : kLongest.back().rows;
}

int ZedControls::gain_register(int percent) {
  int steps = 0;
  for (const GainRange& range : kGainRanges) steps += range.last - range.first;
  int step = static_cast<int>(std::lround(steps * percent / 100.0));
  for (const GainRange& range : kGainRanges) {
    const int length = range.last - range.first;
    if (step <= length) return range.first + step;
    step -= length;
  }
  return kGainRanges.back().last;
}

std::vector<std::uint8_t> ZedControls::message(bool write, const Register& at, std::size_t size) {
  std::vector<std::uint8_t> out(size, 0);
  const bool bridge = at.task == kBridge;
  out[0] = write ? kWrite : kRead;
  out[1] = at.task;
  out[2] = bridge ? 0x00 : 0x6c;
  out[3] = bridge ? 4 : 2;  // bytes of an address
  out[4] = 1;               // bytes of a value
  for (std::size_t i = 0; i < 4; ++i) {
    out[5 + i] = static_cast<std::uint8_t>(at.address >> (24 - 8 * i));
  }
  out[9] = bridge ? 0x00 : 0x90;
  out[10] = 0x01;
  out[12] = 0x01;
  return out;
}

Result<std::uint8_t> ZedControls::read(const Register& at) {
  const auto size = unit_->message_size();
  if (!size) return size.failure();
  if (*size <= kReadAt) return Error{"its messages are of " + std::to_string(*size) + " bytes"};
  std::vector<std::uint8_t> data = message(false, at, *size);
  if (auto sent = unit_->send(data); !sent) return sent.failure();
  std::this_thread::sleep_for(kPause);
  if (auto answered = unit_->receive(data); !answered) return answered.failure();
  return data[kReadAt];
}

Result<void> ZedControls::write(const Register& at, std::uint8_t value) {
  const auto size = unit_->message_size();
  if (!size) return size.failure();
  if (*size <= kReadAt) return Error{"its messages are of " + std::to_string(*size) + " bytes"};
  std::vector<std::uint8_t> data = message(true, at, *size);
  data[kWriteAt] = value;
  if (auto sent = unit_->send(data); !sent) return sent.failure();
  std::this_thread::sleep_for(kPause);
  const auto now = read(at);
  if (!now) return now.failure();
  if (*now == value) return {};
  return Error{"the camera made it " + std::to_string(*now) + " instead of " +
               std::to_string(value)};
}

Result<void> ZedControls::write_sensors(std::uint32_t address, int value) {
  for (const std::uint8_t sensor : kSensors) {
    for (std::uint32_t byte = 0; byte < 3; ++byte) {
      const auto part = static_cast<std::uint8_t>(value >> (16 - 8 * static_cast<int>(byte)));
      if (auto done = write({sensor, address + byte}, part); !done) return done;
    }
  }
  return {};
}

Result<void> ZedControls::set_automatic(bool automatic) {
  for (const std::uint32_t address : kProcessors) {
    const Register at{kBridge, address};
    const auto now = read(at);
    if (!now) return now.failure();
    const auto wanted =
        static_cast<std::uint8_t>(automatic ? *now | kAutomatic : *now & ~kAutomatic);
    if (auto done = write(at, wanted); !done) return done;
  }
  return {};
}

Result<void> ZedControls::set_exposure(int percent) {
  if (auto checked = check_percent(percent); !checked) return checked;
  if (auto by_hand = set_automatic(false); !by_hand) return by_hand;
  const int rows = std::max(kShortestExposure, longest_exposure(frame_rate_) * percent / 100);
  return write_sensors(kExposure, rows << 4);
}

Result<void> ZedControls::set_gain(int percent) {
  if (auto checked = check_percent(percent); !checked) return checked;
  if (auto by_hand = set_automatic(false); !by_hand) return by_hand;
  return write_sensors(kGain, gain_register(percent));
}

bool is_zed_control(const ControlSetting& setting) {
  return setting.name == "zed_auto_exposure" || setting.name == "zed_exposure" ||
         setting.name == "zed_gain";
}

Result<void> apply_zed_controls(ZedControls* zed, const std::vector<ControlSetting>& settings) {
  const auto apply = [zed](const ControlSetting& s) -> Result<void> {
    const auto value = static_cast<int>(std::clamp<std::int64_t>(s.value, -1, 101));
    if (s.name == "zed_exposure") return zed->set_exposure(value);
    if (s.name == "zed_gain") return zed->set_gain(value);
    if (value != 0 && value != 1) return Error{"must be 0 or 1"};
    return zed->set_automatic(value == 1);
  };
  for (const ControlSetting& setting : settings) {
    if (auto done = apply(setting); !done) {
      return Error{setting.name + "=" + std::to_string(setting.value) + ": " + done.error()};
    }
  }
  return {};
}

Result<void> apply_settings(const DeviceFile& file, double frame_rate,
                            const std::vector<ControlSetting>& settings) {
  std::vector<ControlSetting> plain;
  std::vector<ControlSetting> zed;
  for (const ControlSetting& setting : settings) {
    (is_zed_control(setting) ? zed : plain).push_back(setting);
  }
  if (auto set = apply_controls(file, plain); !set || zed.empty()) return set;
  UvcExtensionUnit unit(file, ZedControls::kUnit, ZedControls::kSelector);
  ZedControls controls(&unit, frame_rate);
  return apply_zed_controls(&controls, zed);
}

}  // namespace sovo::v4l2
