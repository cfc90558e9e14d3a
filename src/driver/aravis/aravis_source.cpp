#include "sovo/driver/aravis/aravis_source.h"

#include <cmath>
#include <optional>

#include "sovo/driver/aravis/features.h"
#include "sovo/driver/aravis/gige_capture.h"
#include "sovo/driver/aravis/gige_setup.h"

namespace sovo::aravis {
namespace {

constexpr double kUsualRate = 30.0;        // where neither camera nor user says one [Hz]
constexpr std::size_t kImages = 16;        // a side: queue, pairing, publishing and room
constexpr std::uint8_t kTrackedClock = 1;  // of StereoFrame::clock

GigeOptions side_options(const AravisOptions& options, CameraSide side, const CameraModel& model) {
  GigeOptions gige;
  gige.aravis = options;
  if (options.sync == Sync::kHardware && options.trigger_source.empty()) {
    gige.aravis.trigger_source = "Line0";
  }
  gige.side = side;
  gige.width = model.width;
  gige.height = model.height;
  const auto bytes =
      2 * static_cast<std::size_t>(model.width) * static_cast<std::size_t>(model.height);
  gige.pool = std::make_shared<ImagePool>(kImages, bytes);
  return gige;
}

LiveCamera make_camera(const std::string& name, const GigeOptions& gige, const LiveOptions& live,
                       double rate) {
  LiveCamera camera;
  camera.config.name = name;
  camera.config.stall = std::chrono::milliseconds(std::lround(1e3 * live.stall_s));
  camera.config.longest = std::chrono::milliseconds(std::lround(1e3 * live.longest_wait_s));
  camera.config.frame_rate = rate;
  camera.config.clock_kind = kTrackedClock;
  camera.open = [gige] { return open_gige(gige); };
  return camera;
}

/// Tries a camera when it is there; its rate.
Result<double> try_camera(const GigeOptions& gige, const std::vector<GigeInfo>& cameras,
                          OpenedSource* opened) {
  const auto info = find_camera(cameras, gige.camera());
  if (!info) {
    opened->notes.push_back(info.error() + "; waiting for it");
    return 0.0;
  }
  const auto probe = probe_gige(gige, *info);
  if (!probe) return probe.failure();
  const auto sync = gige.sync->choose(gige.side, probe->ability);
  // That the other camera was not seen yet is said of that one.
  if (!sync && gige.aravis.sync != Sync::kAuto) {
    return Error{gige.camera() + ": " + sync.error()};
  }
  return probe->frame_rate;
}

}  // namespace

Result<void> check_options(const AravisOptions& options, const LiveOptions& live) {
  if (options.left.empty() || options.right.empty()) {
    return Error{"give both cameras: --left SERIAL --right SERIAL; `sovo camera list` shows them"};
  }
  if (options.left == options.right) return Error{"--left and --right are the same camera"};
  if (!(options.frame_rate >= 0.0) || options.frame_rate > 10'000.0) {
    return Error{"camera.aravis.frame_rate must be 0 to 10000"};
  }
  if (options.buffers < 4 || options.buffers > 64) {
    return Error{"camera.aravis.buffers must be 4 to 64"};
  }
  if (options.packet_size != 0 && (options.packet_size < 576 || options.packet_size > 65'535)) {
    return Error{"camera.aravis.packet_size must be 576 to 65535, or 0"};
  }
  if (options.socket_buffer_kb < 0 || options.socket_buffer_kb > 1'000'000 ||
      options.throughput_mbps < 0 || options.throughput_mbps > 100'000) {
    return Error{"camera.aravis.socket_buffer_kb and throughput_mbps must not be negative or huge"};
  }
  if (!(std::abs(options.stamp_offset_ms) <= 1000.0)) {
    return Error{"camera.aravis.stamp_offset_ms must be within a second"};
  }
  if (!(live.stall_s >= 1.0) || !(live.longest_wait_s > 0.0)) {
    return Error{"camera.live.stall_s must be at least 1, and longest_wait_s positive"};
  }
  if (auto features = parse_features(options.features); !features) return features.failure();
  return {};
}

Result<OpenedSource> open_aravis(const AravisOptions& options, const LiveOptions& live,
                                 const std::string& calibration) {
  if (auto checked = check_options(options, live); !checked) return checked.failure();
  if (calibration.empty()) {
    return Error{"no calibration: give one with --calib FILE (see docs/cameras.md)"};
  }
  OpenedSource opened;
  auto loaded = load_calibration(calibration, {});
  if (!loaded) return loaded.failure();
  opened.calibration = std::move(*loaded);
  const StereoRig& rig = opened.calibration.rig;
  GigeOptions left = side_options(options, CameraSide::kLeft, rig.left);
  GigeOptions right = side_options(options, CameraSide::kRight, rig.right);
  left.network = right.network = std::make_shared<GigeNetwork>();
  left.sync = right.sync =
      std::make_shared<SyncChoice>(options.sync, !options.trigger_source.empty());
  const auto cameras = left.network->cameras();
  const auto left_rate = try_camera(left, cameras, &opened);
  if (!left_rate) return left_rate.failure();
  const auto right_rate = try_camera(right, cameras, &opened);
  if (!right_rate) return right_rate.failure();
  double rate = options.frame_rate > 0.0 ? options.frame_rate : *left_rate;
  if (!(rate > 0.0)) rate = *right_rate > 0.0 ? *right_rate : kUsualRate;
  left.trigger_rate = right.trigger_rate = rate;
  LiveSourceConfig config;
  config.pair_tolerance_ns = live.tolerance_ns(rate);
  if (live.auto_exposure.enabled) config.auto_exposure = live.auto_exposure.config();
  std::vector<LiveCamera> live_cameras;
  live_cameras.push_back(make_camera("left", left, live, rate));
  live_cameras.push_back(make_camera("right", right, live, rate));
  opened.source = std::make_unique<LiveSource>(rig, config, std::move(live_cameras));
  return opened;
}

}  // namespace sovo::aravis
