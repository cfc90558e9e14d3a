#include "sovo/app/live_camera.h"

#include <iostream>
#include <memory>

#include "sovo/app/config_options.h"
#include "sovo/app/failure.h"
#include "sovo/app/live_publication.h"
#include "sovo/driver/aravis/aravis_source.h"
#include "sovo/driver/aravis/gige_network.h"
#include "sovo/driver/v4l2/controls.h"
#include "sovo/driver/v4l2/device_list.h"
#include "sovo/driver/v4l2/modes.h"
#include "sovo/driver/v4l2/v4l2_source.h"
#include "sovo/io/text.h"

namespace sovo::app {
namespace {

Result<LiveInput> open_v4l2_input(const CameraSection& camera) {
  auto opened = v4l2::open_v4l2(camera.v4l2, camera.live, camera.calibration);
  if (!opened) return opened.failure();
  return LiveInput{std::move(opened->source), std::move(opened->calibration),
                   std::move(opened->notes)};
}

/// "WIDTHxHEIGHT" into the configuration.
Result<void> apply_size(const std::string& size, CameraSection* camera) {
  if (size.empty()) return {};
  const auto parts = split(size, "x");
  const auto width = parts.size() == 2 ? parse_integer(parts[0]) : std::nullopt;
  const auto height = parts.size() == 2 ? parse_integer(parts[1]) : std::nullopt;
  if (!width || !height || *width < 2 || *height < 1 || *width > 16384 || *height > 16384) {
    return Error{"--size is '" + size + "'; it must be WIDTHxHEIGHT, e.g. 2560x720"};
  }
  camera->v4l2.width = static_cast<int>(*width);
  camera->v4l2.height = static_cast<int>(*height);
  return {};
}

void add_v4l2_command(const Command& camera) {
  const Command command =
      camera.add_command("v4l2", "Publish a ZED, another side-by-side camera, or two cameras");
  auto options = std::make_shared<ConfigOptions>(command);
  auto size = std::make_shared<std::string>();
  options
      ->value("--device", "camera.v4l2.device",
              "Side-by-side camera: path, by-id name, serial number or USB port", "NAME")
      .value("--left", "camera.v4l2.left", "Two cameras: the left one", "NAME")
      .value("--right", "camera.v4l2.right", "Two cameras: the right one", "NAME")
      .value("--rate", "camera.v4l2.frame_rate", "Images a second", "HZ")
      .value("--format", "camera.v4l2.format", "Pixel format", "auto|YUYV|UYVY|GREY|NV12|MJPG")
      .list("--control", "camera.v4l2.controls", "Camera control; may be repeated", "NAME=VALUE")
      .flag("--auto-exposure", "camera.live.auto_exposure.enabled",
            "Exposure control of our own: slow, the same on both sides")
      .value("--calib", "camera.calibration", "Calibration file; a ZED's SN*.conf is one", "FILE")
      .value("--frames", "camera.frames", "End after so many frames", "N")
      .value("--name", "camera.name", "Prefix of the camera's frame names", "NAME");
  command.option("--size", "Of the device's image, both sides together", size.get())
      .type("WIDTHxHEIGHT");
  add_dds_options(*options);
  command.action([options, size] {
    auto config = options->load();
    if (!config) return fail(kUsage, config.error());
    if (auto applied = apply_size(*size, &config->camera); !applied) {
      return fail(kUsage, applied.error());
    }
    if (auto sane = v4l2::check_options(config->camera.v4l2, config->camera.live); !sane) {
      return fail(kUsage, sane.error());
    }
    return publish_live(*config, [&config] { return open_v4l2_input(config->camera); });
  });
}

Result<LiveInput> open_aravis_input(const CameraSection& camera) {
  auto opened = aravis::open_aravis(camera.aravis, camera.live, camera.calibration);
  if (!opened) return opened.failure();
  return LiveInput{std::move(opened->source), std::move(opened->calibration),
                   std::move(opened->notes)};
}

void add_aravis_command(const Command& camera) {
  const Command command = camera.add_command("aravis", "Publish two GigE Vision cameras");
  auto options = std::make_shared<ConfigOptions>(command);
  options->value("--left", "camera.aravis.left", "Left camera: serial number or address", "SERIAL")
      .value("--right", "camera.aravis.right", "Right camera", "SERIAL")
      .value("--rate", "camera.aravis.frame_rate", "Images a second", "HZ")
      .value("--format", "camera.aravis.pixel_format", "Pixel format, e.g. Mono8", "NAME")
      .value("--sync", "camera.aravis.sync", "What makes both expose at one instant",
             "auto|hardware|action|ptp|software|free")
      .value("--trigger-source", "camera.aravis.trigger_source", "Wired line of sync hardware",
             "LINE")
      .list("--feature", "camera.aravis.features", "GenICam feature; may be repeated", "NAME=VALUE")
      .flag("--auto-exposure", "camera.live.auto_exposure.enabled",
            "Exposure control of our own: slow, the same on both sides")
      .value("--calib", "camera.calibration", "Calibration file", "FILE")
      .value("--frames", "camera.frames", "End after so many frames", "N")
      .value("--name", "camera.name", "Prefix of the camera's frame names", "NAME");
  add_dds_options(*options);
  command.action([options] {
    const auto config = options->load();
    if (!config) return fail(kUsage, config.error());
    if (auto sane = aravis::check_options(config->camera.aravis, config->camera.live); !sane) {
      return fail(kUsage, sane.error());
    }
    return publish_live(*config, [&config] { return open_aravis_input(config->camera); });
  });
}

void list_network_cameras() {
  aravis::GigeNetwork network;
  const auto cameras = network.cameras();
  if (cameras.empty()) std::cout << "no GigE Vision camera answers\n";
  for (const aravis::GigeInfo& info : cameras) {
    const aravis::InterfaceInfo interface = aravis::find_interface(info.address);
    std::cout << info.address << ": " << info.name << ", serial " << info.serial;
    if (interface.name.empty()) {
      std::cout << "\n  not in the subnet of any port of this machine: it cannot stream\n";
      continue;
    }
    std::cout << ", at " << interface.name << " (MTU " << interface.mtu;
    if (interface.speed_mbps > 0) std::cout << ", " << interface.speed_mbps << " Mbit/s";
    std::cout << ")\n";
  }
}

void print_modes(const v4l2::DeviceFile& file) {
  for (const v4l2::Mode& mode : v4l2::list_modes(file)) {
    std::cout << "  mode " << mode.width << "x" << mode.height << " " << mode.format;
    for (std::size_t i = 0; i < mode.rates.size(); ++i) {
      std::cout << (i == 0 ? " at " : ", ") << format_fixed(mode.rates[i], 0);
    }
    std::cout << (mode.rates.empty() ? "\n" : " Hz\n");
  }
}

void print_controls(const v4l2::DeviceFile& file) {
  for (const v4l2::ControlInfo& control : v4l2::list_controls(file)) {
    std::cout << "  control " << control.name << "=" << control.value << " (" << control.least
              << " to " << control.most << ", default " << control.preset;
    if (control.read_only) std::cout << ", read only";
    if (control.inactive) std::cout << ", overruled by an automatic one";
    std::cout << ")";
    for (const std::string& item : control.menu) std::cout << " [" << item << "]";
    std::cout << "\n";
  }
}

/// What is attached, a paragraph each.
int list_cameras() {
  const auto devices = v4l2::list_devices();
  if (devices.empty()) std::cout << "no V4L2 camera is attached\n";
  for (const v4l2::DeviceInfo& info : devices) {
    const auto file = v4l2::DeviceFile::open(info.path);
    const auto modes = file ? v4l2::list_modes(*file) : std::vector<v4l2::Mode>();
    if (file && modes.empty()) continue;  // a node for metadata, or an output
    std::cout << info.path << ": " << info.name;
    if (!info.vendor_id.empty()) {
      std::cout << ", USB " << info.vendor_id << ":" << info.product_id << " at port " << info.port
                << ", " << info.speed_mbps << " Mbit/s";
    }
    if (!info.serial.empty()) std::cout << ", serial " << info.serial;
    std::cout << "\n";
    if (!info.by_id.empty()) std::cout << "  link " << info.by_id << "\n";
    if (!file) {
      std::cout << "  " << file.error() << "\n";
      continue;
    }
    print_modes(*file);
    print_controls(*file);
  }
  list_network_cameras();
  return kOk;
}

}  // namespace

void add_live_camera_commands(const Command& camera) {
  add_v4l2_command(camera);
  add_aravis_command(camera);
  camera.add_command("list", "What is attached: devices, modes, controls, serial numbers")
      .action(list_cameras);
}

}  // namespace sovo::app
