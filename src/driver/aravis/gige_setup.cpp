#include "sovo/driver/aravis/gige_setup.h"

#include <arpa/inet.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "sovo/driver/aravis/features.h"

namespace sovo::aravis {
namespace {

sockaddr_in to_ipv4(GSocketAddress* address) {
  sockaddr_in result{};
  if (address != nullptr && g_socket_address_get_native_size(address) == sizeof result) {
    g_socket_address_to_native(address, &result, sizeof result, nullptr);
  }
  return result;
}

std::string dotted(const sockaddr_in& address) {
  std::array<char, INET_ADDRSTRLEN> text{};
  ::inet_ntop(AF_INET, &address.sin_addr, text.data(), text.size());
  return text.data();
}

std::string size_text(int width, int height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

Result<void> set_up_action(ArvDevice* device) {
  if (has_feature(device, "ActionSelector")) {
    if (auto set = set_feature(device, {"ActionSelector", "1"}); !set) {
      // Some count from 0.
      if (set = set_feature(device, {"ActionSelector", "0"}); !set) return set;
    }
  }
  // The device key can be written and not read.
  Problem problem;
  arv_device_set_integer_feature_value(device, "ActionDeviceKey", kActionKeys.device,
                                       problem.slot());
  if (problem) return Error{"ActionDeviceKey: " + problem.text()};
  if (auto set = set_feature(device, {"ActionGroupKey", std::to_string(kActionKeys.group)}); !set) {
    return set;
  }
  return set_feature(device, {"ActionGroupMask", std::to_string(kActionKeys.mask)});
}

/// The name of the source of the first action: cameras begin with 1, some with 0.
std::string action_source(ArvDevice* device) {
  for (const char* name : {"Action1", "Action0", "TriggerAction1"}) {
    if (has_entry(device, "TriggerSource", name)) return name;
  }
  return "";
}

void turn_triggers_off(ArvDevice* device) {
  if (!has_feature(device, "TriggerMode")) return;
  Problem problem;
  arv_device_set_string_feature_value(device, "TriggerMode", "Off", problem.slot());
}

/// Limits by the camera's own means, else by a pause between packets. A port of unknown speed (0)
/// is taken as infinitely fast: the pause is then a little too long, never too short.
Result<void> limit_throughput(ArvCamera* camera, int mbps, int packet_size, int port_mbps) {
  ArvDevice* device = arv_camera_get_device(camera);
  Problem problem;
  if (has_feature(device, "DeviceLinkThroughputLimit")) {
    if (has_feature(device, "DeviceLinkThroughputLimitMode")) {
      arv_device_set_string_feature_value(device, "DeviceLinkThroughputLimitMode", "On",
                                          problem.slot());
    }
    gint64 least = 0;
    gint64 most = 0;
    arv_device_get_integer_feature_bounds(device, "DeviceLinkThroughputLimit", &least, &most,
                                          problem.slot());
    std::int64_t limit = std::int64_t{mbps} * 125'000;
    if (!problem && least <= most) limit = std::clamp<std::int64_t>(limit, least, most);
    arv_device_set_integer_feature_value(device, "DeviceLinkThroughputLimit", limit,
                                         problem.slot());
  } else if (port_mbps == 0 || port_mbps > mbps) {
    const double bits = 8.0 * packet_size;
    const double on_the_wire = port_mbps > 0 ? bits / port_mbps : 0.0;
    const double pause_ns = 1e3 * (bits / mbps - on_the_wire);
    arv_camera_gv_set_packet_delay(camera, static_cast<gint64>(pause_ns), problem.slot());
  }
  if (problem) return Error{"limit of " + std::to_string(mbps) + " Mbit/s: " + problem.text()};
  return {};
}

}  // namespace

Result<Owned<ArvCamera>> open_camera(const GigeInfo& info) {
  Problem problem;
  Owned<ArvCamera> camera(arv_camera_new(info.id.c_str(), problem.slot()));
  if (!camera) return Error{"cannot be opened: " + problem.text()};
  ArvDevice* device = arv_camera_get_device(camera.get());
  if (ARV_IS_GV_DEVICE(device) == FALSE) return Error{"this is no GigE Vision camera"};
  if (arv_gv_device_is_controller(ARV_GV_DEVICE(device)) == FALSE) {
    return Error{
        "another program controls this camera; end it, or wait until the camera has "
        "given it up (3 s after a crash)"};
  }
  return camera;
}

Result<void> set_up_image(ArvCamera* camera, const GigeOptions& options) {
  ArvDevice* device = arv_camera_get_device(camera);
  Problem problem;
  // A program that crashed may have left it streaming, and then nothing can be set.
  arv_camera_stop_acquisition(camera, problem.slot());
  turn_triggers_off(device);
  arv_camera_set_pixel_format_from_string(camera, options.aravis.pixel_format.c_str(),
                                          problem.slot());
  if (problem) return Error{"pixel format " + options.aravis.pixel_format + ": " + problem.text()};
  const auto format = sensor_format(arv_camera_get_pixel_format(camera, problem.slot()));
  if (problem || !format) {
    return Error{"pixel format " + options.aravis.pixel_format +
                 " cannot be read; take Mono8, Mono10, Mono12, Mono16, a packed one or BayerXX8"};
  }
  arv_camera_set_region(camera, -1, -1, options.width, options.height, problem.slot());
  gint x = 0;
  gint y = 0;
  gint width = 0;
  gint height = 0;
  if (!problem) arv_camera_get_region(camera, &x, &y, &width, &height, problem.slot());
  if (problem) {
    return Error{"size " + size_text(options.width, options.height) +
                 " of the calibration: " + problem.text()};
  }
  if (width != options.width || height != options.height) {
    return Error{"the camera gives images of " + size_text(width, height) +
                 ", the calibration is for " + size_text(options.width, options.height)};
  }
  if (options.aravis.frame_rate > 0.0) {
    arv_camera_set_frame_rate(camera, options.aravis.frame_rate, problem.slot());
    if (problem) return Error{"frame rate: " + problem.text()};
  }
  arv_camera_set_acquisition_mode(camera, ARV_ACQUISITION_MODE_CONTINUOUS, problem.slot());
  if (problem) return Error{"continuous acquisition: " + problem.text()};
  return {};
}

SyncAbility sync_ability(ArvDevice* device, const std::string& trigger_source) {
  SyncAbility ability;
  ability.line = !trigger_source.empty() && has_entry(device, "TriggerSource", trigger_source);
  ability.ptp = first_feature(device, {"PtpEnable", "GevIEEE1588"}) != nullptr;
  ability.action = has_feature(device, "ActionDeviceKey") &&
                   has_feature(device, "ActionGroupKey") &&
                   has_feature(device, "ActionGroupMask") && !action_source(device).empty();
  ability.software =
      has_entry(device, "TriggerSource", "Software") && has_feature(device, "TriggerSoftware");
  return ability;
}

Result<void> set_up_sync(ArvDevice* device, Sync sync, const std::string& trigger_source) {
  if (sync == Sync::kAction || sync == Sync::kPtp) {
    const char* ptp = first_feature(device, {"PtpEnable", "GevIEEE1588"});
    if (auto set = set_feature(device, {ptp == nullptr ? "PtpEnable" : ptp, "true"}); !set) {
      return set;
    }
  }
  std::string source;
  if (sync == Sync::kHardware) source = trigger_source;
  if (sync == Sync::kAction) source = action_source(device);
  if (sync == Sync::kSoftware) source = "Software";
  if (source.empty()) return {};
  if (sync == Sync::kAction) {
    if (auto set = set_up_action(device); !set) return set;
  }
  for (const FeatureSetting& setting :
       {FeatureSetting{"TriggerSelector", "FrameStart"}, FeatureSetting{"TriggerMode", "On"},
        FeatureSetting{"TriggerSource", source}}) {
    if (setting.name == "TriggerSelector" && !has_feature(device, "TriggerSelector")) continue;
    if (auto set = set_feature(device, setting); !set) return set;
  }
  return {};
}

ChunkUse set_up_chunks(ArvDevice* device) {
  ChunkUse use;
  if (!has_feature(device, "ChunkModeActive")) return use;
  if (!set_feature(device, {"ChunkModeActive", "true"})) return use;
  const auto enable = [device](const char* chunk) {
    return has_entry(device, "ChunkSelector", chunk) &&
           set_feature(device, {"ChunkSelector", chunk}).ok() &&
           set_feature(device, {"ChunkEnable", "true"}).ok();
  };
  use.stamp = enable("Timestamp");
  use.exposure = enable("ExposureTime");
  // Nothing of use: images without chunks can be read by more programs.
  if (!use.stamp && !use.exposure) (void)set_feature(device, {"ChunkModeActive", "false"});
  return use;
}

Result<LinkSetup> set_up_link(ArvCamera* camera, const AravisOptions& options, bool shared) {
  ArvGvDevice* device = ARV_GV_DEVICE(arv_camera_get_device(camera));
  LinkSetup link;
  const sockaddr_in own = to_ipv4(arv_gv_device_get_interface_address(device));
  link.camera = to_ipv4(arv_gv_device_get_device_address(device));
  link.camera.sin_port = htons(3956);
  link.interface = find_interface(dotted(own));
  link.packet_size = fit_packet_size(options.packet_size, link.interface.mtu);
  Problem problem;
  // libaravis' own search may end above the MTU.
  arv_camera_gv_set_packet_size_adjustment(camera, ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
  arv_camera_gv_set_packet_size(camera, link.packet_size, problem.slot());
  if (!problem) {
    link.packet_size = static_cast<int>(arv_camera_gv_get_packet_size(camera, problem.slot()));
  }
  if (problem) return Error{"packet size: " + problem.text()};
  if (link.packet_size > link.interface.mtu) {
    return Error{"the camera sends packets of " + std::to_string(link.packet_size) +
                 " bytes, interface " + link.interface.name + " carries " +
                 std::to_string(link.interface.mtu) + "; raise its MTU: sudo ip link set dev " +
                 link.interface.name + " mtu 9000"};
  }
  if ((ntohl(own.sin_addr.s_addr) >> 24U) == 127) {
    // A packet socket sees nothing of that interface.
    arv_gv_device_set_stream_options(device, ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  }
  const int port = link.interface.speed_mbps;
  link.limit_mbps = options.throughput_mbps;
  if (link.limit_mbps == 0 && shared) link.limit_mbps = port_share(port);
  if (link.limit_mbps > 0) {
    auto limited = limit_throughput(camera, link.limit_mbps, link.packet_size, port);
    if (!limited) return limited.failure();
  }
  return link;
}

std::optional<SensorFormat> sensor_format(ArvPixelFormat format) {
  constexpr ArvPixelFormat kMono10p = 0x010a0046;  // of PFNC, for which there is no name
  constexpr ArvPixelFormat kMono12p = 0x010c0047;
  switch (format) {
    case ARV_PIXEL_FORMAT_MONO_8:
      return SensorFormat::kMono8;
    case ARV_PIXEL_FORMAT_MONO_10:
      return SensorFormat::kMono10;
    case ARV_PIXEL_FORMAT_MONO_10_PACKED:
      return SensorFormat::kMono10Packed;
    case kMono10p:
      return SensorFormat::kMono10p;
    case ARV_PIXEL_FORMAT_MONO_12:
      return SensorFormat::kMono12;
    case ARV_PIXEL_FORMAT_MONO_12_PACKED:
      return SensorFormat::kMono12Packed;
    case kMono12p:
      return SensorFormat::kMono12p;
    case ARV_PIXEL_FORMAT_MONO_16:
      return SensorFormat::kMono16;
    case ARV_PIXEL_FORMAT_BAYER_RG_8:
    case ARV_PIXEL_FORMAT_BAYER_GR_8:
    case ARV_PIXEL_FORMAT_BAYER_GB_8:
    case ARV_PIXEL_FORMAT_BAYER_BG_8:
      return SensorFormat::kBayer8;
    default:
      return std::nullopt;
  }
}

}  // namespace sovo::aravis
