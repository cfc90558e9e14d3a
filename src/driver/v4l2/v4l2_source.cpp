#include "sovo/driver/v4l2/v4l2_source.h"

#include <atomic>
#include <cmath>
#include <filesystem>
#include <optional>

#include "sovo/driver/v4l2/capture.h"
#include "sovo/driver/v4l2/device_finder.h"
#include "sovo/driver/v4l2/zed_controls.h"

namespace sovo::v4l2 {
namespace {

namespace fs = std::filesystem;

constexpr const char* kZedSettings = "/usr/local/zed/settings";
constexpr double kUsualRate = 30.0;     // where neither driver nor user says one [Hz]
constexpr std::size_t kImages = 12;     // a side: queue, pairing, publishing and room
constexpr std::uint8_t kHostClock = 0;  // of StereoFrame::clock

/// Calibration that Stereolabs' programs leave on the machine.
std::string zed_settings(const std::string& serial) {
  std::error_code error;
  const fs::path own = fs::path(kZedSettings) / ("SN" + serial + ".conf");
  if (!serial.empty() && fs::exists(own, error)) return own.string();
  std::vector<std::string> found;
  for (const auto& entry : fs::directory_iterator(kZedSettings, error)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("SN") && name.ends_with(".conf")) found.push_back(entry.path().string());
  }
  return found.size() == 1 ? found.front() : "";
}

/// One device while it is looked up: its mode now, when it is there.
struct Probe {
  std::string wish;
  std::optional<DeviceInfo> info;
  std::optional<StreamMode> mode;
};

/// Looks whether the device does what is asked for. Not being there is no error.
Result<Probe> probe(const std::string& wish, const V4l2Options& options, OpenedSource* opened) {
  Probe result{wish, std::nullopt, std::nullopt};
  const auto info = find_device(list_devices(), wish);
  if (!info) {
    opened->notes.push_back(info.error() + "; waiting for it");
    return result;
  }
  result.info = *info;
  const auto problem = [&info](const Error& e) { return Error{info->path + ": " + e.message}; };
  auto file = DeviceFile::open(info->path);
  if (!file) return file.failure();
  const auto mode = set_mode(*file, options);
  if (!mode) return problem(mode.failure());
  result.mode = *mode;
  const auto settings = parse_controls(options.controls);
  if (auto set = apply_settings(*file, mode->frame_rate, *settings); !set) {
    return problem(set.failure());
  }
  return result;
}

Result<Calibration> load(const std::string& path, const V4l2Options& options, const Probe& left) {
  CalibrationOptions sizes;
  const int width = left.mode ? left.mode->width : options.width;
  sizes.image_width = options.two_devices() ? width : width / 2;
  sizes.image_height = left.mode ? left.mode->height : options.height;
  if (!path.empty()) return load_calibration(path, sizes);
  const std::string own = left.info && left.info->is_zed() ? zed_settings(left.info->serial) : "";
  if (!own.empty()) return load_calibration(own, sizes);
  return Error{
      "no calibration: give one with --calib FILE; a ZED's own is at "
      "https://calib.stereolabs.com/?SN=SERIAL (see docs/cameras.md)"};
}

CaptureOptions capture_options(const V4l2Options& options, const CameraModel& camera,
                               const ColourWanted& colour_wanted) {
  CaptureOptions capture;
  capture.colour_wanted = colour_wanted;
  capture.v4l2 = options;
  capture.side_by_side = !options.two_devices();
  const auto bytes = static_cast<std::size_t>(camera.width) * camera.height;
  capture.pools = std::make_shared<CapturePools>(CapturePools{
      ImagePool(kImages, bytes), ImagePool(capture.side_by_side ? kImages : 0, bytes)});
  capture.width = camera.width;
  capture.height = camera.height;
  return capture;
}

LiveCamera make_camera(const std::string& name, CameraWorker::Open open, const LiveOptions& live,
                       double rate) {
  LiveCamera camera;
  camera.config.name = name;
  camera.config.stall = std::chrono::milliseconds(std::lround(1e3 * live.stall_s));
  camera.config.longest = std::chrono::milliseconds(std::lround(1e3 * live.longest_wait_s));
  camera.config.frame_rate = rate;
  camera.config.shared_clock = true;
  camera.config.clock_kind = kHostClock;
  // Both clocks are this machine's and read together: a difference is no delay.
  camera.config.clock.step_s = 1e-3;
  camera.config.clock.step_readings = 1;
  camera.config.clock.late_step_s = 0.0;
  camera.config.clock.first_sigma_s = 50e-6;
  camera.open = std::move(open);
  return camera;
}

Result<void> check_fit(const Probe& probe, const CameraModel& camera, bool side_by_side) {
  if (!probe.mode) return {};
  CaptureOptions options;
  options.side_by_side = side_by_side;
  options.width = camera.width;
  options.height = camera.height;
  if (auto fits = check_size(*probe.mode, options); !fits) {
    return Error{probe.info->path + ": " + fits.error()};
  }
  return {};
}

/// Whether the two make a pair.
Result<void> check_pair(const Probe& left, const Probe& right, OpenedSource* opened) {
  if (left.info && right.info && is_same(*left.info, *right.info)) {
    return Error{"'" + left.wish + "' and '" + right.wish + "' are the same device, " +
                 left.info->path};
  }
  const bool known = left.mode && right.mode;
  if (known && std::abs(left.mode->frame_rate / right.mode->frame_rate - 1.0) > 0.01) {
    opened->notes.push_back("left gives " + to_string(*left.mode) + ", right " +
                            to_string(*right.mode) +
                            ": images without a partner go alone; --rate sets both");
  }
  return {};
}

}  // namespace

Result<void> check_options(const V4l2Options& options, const LiveOptions& live) {
  if (options.left.empty() != options.right.empty()) {
    return Error{"--left and --right go together; one side-by-side camera is --device"};
  }
  if (options.two_devices() && !options.device.empty()) {
    return Error{"give either --device, or --left and --right"};
  }
  if (options.two_devices() && options.left == options.right) {
    return Error{"--left and --right are the same device"};
  }
  if ((options.width > 0) != (options.height > 0) || options.width < 0) {
    return Error{"camera.v4l2.width and height must both be positive, or both 0"};
  }
  if (options.buffers < 4 || options.buffers > 32) {
    return Error{"camera.v4l2.buffers must be 4 to 32"};
  }
  if (!(live.stall_s > 0.0) || !(live.longest_wait_s > 0.0)) {
    return Error{"camera.live.stall_s and longest_wait_s must be positive"};
  }
  if (auto controls = parse_controls(options.controls); !controls) return controls.failure();
  return {};
}

Result<OpenedSource> open_v4l2(const V4l2Options& options, const LiveOptions& live,
                               const std::string& calibration) {
  if (auto checked = check_options(options, live); !checked) return checked.failure();
  OpenedSource opened;
  const bool two = options.two_devices();
  const auto left = probe(two ? options.left : options.device, options, &opened);
  if (!left) return left.failure();
  auto loaded = load(calibration, options, *left);
  if (!loaded) return loaded.failure();
  opened.calibration = std::move(*loaded);
  const StereoRig& rig = opened.calibration.rig;
  if (auto fits = check_fit(*left, rig.left, !two); !fits) return fits.failure();
  double rate = options.frame_rate;
  if (rate <= 0.0 && left->mode) rate = left->mode->frame_rate;
  if (rate <= 0.0) rate = kUsualRate;
  LiveSourceConfig config;
  config.pair_tolerance_ns = live.tolerance_ns(rate);
  config.colour_wanted = std::make_shared<std::atomic<bool>>(false);
  if (live.auto_exposure.enabled) config.auto_exposure = live.auto_exposure.config();
  const auto finder = std::make_shared<DeviceFinder>(two ? std::vector{options.left, options.right}
                                                         : std::vector{options.device});
  std::vector<LiveCamera> cameras;
  const auto add = [&](const char* name, const CameraModel& model) {
    const auto open = [finder, i = cameras.size(),
                       capture = capture_options(options, model, config.colour_wanted)]()
        -> Result<std::unique_ptr<CaptureDevice>> {
      const auto info = finder->find(i);
      if (!info) return info.failure();
      return V4l2Capture::open(info->path, capture);
    };
    cameras.push_back(make_camera(name, open, live, rate));
  };
  add(two ? "left" : "camera", rig.left);
  if (two) {
    const auto right = probe(options.right, options, &opened);
    if (!right) return right.failure();
    if (auto fits = check_fit(*right, rig.right, false); !fits) return fits.failure();
    if (auto apart = check_pair(*left, *right, &opened); !apart) return apart.failure();
    add("right", rig.right);
  }
  opened.source = std::make_unique<LiveSource>(rig, config, std::move(cameras));
  return opened;
}

}  // namespace sovo::v4l2
