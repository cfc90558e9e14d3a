#include "driver/aravis/gige_description.h"

#include <cstdio>
#include <initializer_list>
#include <utility>

#include "driver/aravis/gige_simulator.h"

namespace sovo::gige {
namespace {

std::string hex(unsigned value) {
  char text[16];
  std::snprintf(text, sizeof text, "0x%x", value);
  return text;
}

std::string reg(const std::string& kind, const std::string& name, unsigned address, int length,
                const std::string& port = "Device") {
  return "<" + kind + " Name=\"" + name + "\"><Address>" + hex(address) + "</Address><Length>" +
         std::to_string(length) + "</Length><AccessMode>RW</AccessMode><pPort>" + port +
         "</pPort><Cachable>NoCache</Cachable>" +
         (kind == "IntReg" ? "<Sign>Unsigned</Sign>" : "") + "<Endianess>BigEndian</Endianess></" +
         kind + ">\n";
}

std::string integer(const std::string& name, unsigned address, long most, int length = 4) {
  return "<Integer Name=\"" + name + "\"><pValue>" + name + "Reg</pValue><Min>0</Min><Max>" +
         std::to_string(most) + "</Max></Integer>\n" + reg("IntReg", name + "Reg", address, length);
}

std::string real(const std::string& name, unsigned address) {
  return "<Float Name=\"" + name + "\"><pValue>" + name +
         "Reg</pValue><Min>0</Min><Max>1000000</Max></Float>\n" +
         reg("FloatReg", name + "Reg", address, 4);
}

std::string boolean(const std::string& name, unsigned address) {
  return "<Boolean Name=\"" + name + "\"><pValue>" + name +
         "Reg</pValue><OnValue>1</OnValue><OffValue>0</OffValue></Boolean>\n" +
         reg("IntReg", name + "Reg", address, 4);
}

std::string command(const std::string& name, unsigned address) {
  return "<Command Name=\"" + name + "\"><pValue>" + name +
         "Reg</pValue><CommandValue>1</CommandValue></Command>\n" +
         reg("IntReg", name + "Reg", address, 4);
}

using Entries = std::initializer_list<std::pair<const char*, unsigned>>;

std::string choice(const std::string& name, unsigned address, const Entries& entries) {
  std::string text = "<Enumeration Name=\"" + name + "\">";
  for (const auto& [entry, value] : entries) {
    text += std::string("<EnumEntry Name=\"") + entry + "\"><Value>" + std::to_string(value) +
            "</Value></EnumEntry>";
  }
  return text + "<pValue>" + name + "Reg</pValue></Enumeration>\n" +
         reg("IntReg", name + "Reg", address, 4);
}

std::string triggers(const GigeSimulatorConfig& config) {
  std::string text = choice("TriggerSelector", kTriggerSelector, {{"FrameStart", 0}}) +
                     choice("TriggerMode", kTriggerMode, {{"Off", 0}, {"On", 1}});
  if (config.action) {
    text +=
        choice("TriggerSource", kTriggerSource, {{"Line0", 1}, {"Software", 0}, {"Action1", 2}});
    text += integer("ActionSelector", kActionSelector, 1);
    text += integer("ActionDeviceKey", kActionDeviceKey, 4294967295);
    text += integer("ActionGroupKey", kActionGroupKey, 4294967295);
    text += integer("ActionGroupMask", kActionGroupMask, 4294967295);
  } else {
    text += choice("TriggerSource", kTriggerSource, {{"Line0", 1}, {"Software", 0}});
  }
  if (config.software) text += command("TriggerSoftware", kTriggerSoftware);
  return text;
}

std::string chunks() {
  return boolean("ChunkModeActive", kChunkMode) +
         choice("ChunkSelector", kChunkSelector, {{"Timestamp", 0}, {"ExposureTime", 1}}) +
         boolean("ChunkEnable", kChunkEnable) +
         "<Port Name=\"ChunkStamp\"><ChunkID>1001</ChunkID>" +
         "</Port><Port Name=\"ChunkExposure\"><ChunkID>1002</ChunkID></Port>\n" +
         reg("IntReg", "ChunkTimestamp", 0, 8, "ChunkStamp") +
         reg("FloatReg", "ChunkExposureTime", 0, 4, "ChunkExposure");
}

std::string ptp() {
  return boolean("PtpEnable", kPtpEnable) +
         choice("PtpStatus", kPtpStatus, {{"Disabled", 0}, {"Listening", 1}, {"Slave", 2}}) +
         command("PtpDataSetLatch", kPtpLatch) +
         integer("PtpOffsetFromMaster", kPtpOffset, 1000000);
}

}  // namespace

std::string gige_description(const GigeSimulatorConfig& config) {
  std::string text =
      "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<RegisterDescription "
      "xmlns=\"http://www.genicam.org/GenApi/Version_1_1\" ModelName=\"Simulator\" "
      "VendorName=\"sovo\" StandardNameSpace=\"GEV\" SchemaMajorVersion=\"1\" "
      "SchemaMinorVersion=\"1\" SchemaSubMinorVersion=\"0\" MajorVersion=\"1\" MinorVersion=\"0\" "
      "SubMinorVersion=\"0\">\n<Category Name=\"Root\"></Category>\n<Port "
      "Name=\"Device\"></Port>\n";
  text += integer("Width", kWidth, config.width) + integer("Height", kHeight, config.height);
  text += integer("OffsetX", kOffsetX, 0) + integer("OffsetY", kOffsetY, 0);
  text += choice("PixelFormat", kPixelFormat, {{"Mono8", 0x01080001}, {"RGB8", 0x02180014}});
  text += integer("PayloadSize", kPayloadSize, 100000000);
  text += choice("AcquisitionMode", kAcquisitionMode, {{"Continuous", 0}});
  text += command("AcquisitionStart", kAcquisitionStart);
  text += command("AcquisitionStop", kAcquisitionStop);
  text += real("AcquisitionFrameRate", kFrameRate) + real("ExposureTime", kExposure);
  text += real("Gain", kGain) + real("DeviceTemperature", kTemperature);
  if (config.throughput_limit) {
    text += integer("DeviceLinkThroughputLimit", kThroughputLimit, 125000000);
  }
  text += command("TimestampLatch", kTimestampLatch);
  text += integer("TimestampLatchValue", kTimestampValue, 9223372036854775807, 8);
  text += triggers(config);
  if (config.chunks) text += chunks();
  if (config.ptp) text += ptp();
  return text + "</RegisterDescription>\n";
}

}  // namespace sovo::gige
