#pragma once

#include <string>

namespace sovo::gige {

struct GigeSimulatorConfig;

/// Registers of the simulator's features.
enum GigeRegister : unsigned {
  kWidth = 0x4000,
  kHeight = 0x4004,
  kOffsetX = 0x4008,
  kOffsetY = 0x400c,
  kPixelFormat = 0x4010,
  kPayloadSize = 0x4014,
  kAcquisitionMode = 0x4018,
  kAcquisitionStart = 0x401c,
  kAcquisitionStop = 0x4020,
  kFrameRate = 0x4024,
  kExposure = 0x4028,
  kGain = 0x402c,
  kTriggerSelector = 0x4030,
  kTriggerMode = 0x4034,
  kTriggerSource = 0x4038,
  kTriggerSoftware = 0x403c,
  kChunkMode = 0x4040,
  kChunkSelector = 0x4044,
  kChunkEnable = 0x4048,
  kPtpEnable = 0x4050,
  kPtpStatus = 0x4054,
  kPtpLatch = 0x4058,
  kPtpOffset = 0x405c,
  kActionSelector = 0x4060,
  kActionDeviceKey = 0x4064,
  kActionGroupKey = 0x4068,
  kActionGroupMask = 0x406c,
  kTimestampLatch = 0x4070,
  kTimestampValue = 0x4078,
  kTemperature = 0x4080,
  kThroughputLimit = 0x4084,
};

constexpr unsigned kChunkIdStamp = 0x1001;
constexpr unsigned kChunkIdExposure = 0x1002;
constexpr unsigned kChunkIdImage = 0x1000;

/// The simulator's GenICam description.
std::string gige_description(const GigeSimulatorConfig& config);

}  // namespace sovo::gige
