#include "sovo/driver/aravis/gige_capture.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>

#include "sovo/driver/aravis/features.h"
#include "sovo/driver/aravis/frame_gaps.h"
#include "sovo/driver/aravis/gige_control.h"
#include "sovo/driver/aravis/gige_setup.h"
#include "sovo/driver/aravis/periodic_trigger.h"

namespace sovo::aravis {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr std::chrono::seconds kAskCameraEvery(1);
/// Silence after which a camera is asked whether it is still there, and how long it may take.
constexpr std::chrono::milliseconds kQuiet(500);
constexpr std::chrono::milliseconds kAnswerTime(200);
constexpr std::int64_t kLongestLeadNs = 50'000'000;

Error named(const std::string& camera, const Error& error) {
  return Error{camera + ": " + error.message};
}

/// Where a camera's clock cannot be read, arrivals stand for it, and any of them may be late. The
/// first images are held back until the promptest of a few is known: with a clock that is off by
/// half a period they would be paired with their neighbours.
class ArrivalClock {
 public:
  /// Whether an image that was stamped and arrived then shall be held back.
  bool hold_back(std::int64_t device_ns, std::int64_t arrival_ns) {
    if (images_ == 0) begin_ns_ = arrival_ns;
    const std::int64_t delay = arrival_ns - device_ns;
    least_ns_ = images_ == 0 ? delay : std::min(least_ns_, delay);
    ++images_;
    return images_ <= kImages && arrival_ns - begin_ns_ < kLongestNs;
  }
  /// When an image stamped so would have arrived promptly.
  std::int64_t prompt(std::int64_t device_ns) const { return device_ns + least_ns_; }

 private:
  static constexpr int kImages = 15;
  static constexpr std::int64_t kLongestNs = 2'000'000'000;
  int images_ = 0;
  std::int64_t begin_ns_ = 0;
  std::int64_t least_ns_ = 0;
};

/// A stream of libaravis as a capture device.
class GigeCapture : public CaptureDevice {
 public:
  GigeCapture(Owned<ArvCamera> camera, const GigeOptions& options, GvcpSocket probe)
      : camera_(std::move(camera)), options_(options), probe_(std::move(probe)) {}
  ~GigeCapture() override;
  GigeCapture(const GigeCapture&) = delete;
  GigeCapture& operator=(const GigeCapture&) = delete;

  /// `shared`: the other camera is on the same interface.
  Result<void> start(Sync sync, const LinkSetup& link);

  CaptureState next(std::chrono::milliseconds timeout, Capture* capture) override;
  Result<void> set_exposure(const Exposure& exposure) override;
  std::optional<double> temperature() override { return control_->state().temperature_c; }
  std::vector<std::pair<std::string, std::string>> counters() override;
  std::string description() const override;

 private:
  static void on_lost(ArvDevice* /*device*/, gpointer lost) {
    *static_cast<std::atomic<bool>*>(lost) = true;
  }
  ArvDevice* device() const { return arv_camera_get_device(camera_.get()); }

  Result<void> create_stream();
  Result<void> start_trigger();
  CaptureState check_silence(SteadyClock::time_point now, Capture* capture);
  CaptureState gone(Capture* capture, const std::string& why);
  CaptureState read(ArvBuffer* buffer, Capture* capture);
  void fill_times(ArvBuffer* buffer, Capture* capture) const;
  bool is_held_back(Capture* capture);
  void ask_camera(SteadyClock::time_point now);

  Owned<ArvCamera> camera_;
  GigeOptions options_;
  GvcpSocket probe_;
  LinkSetup link_;
  Sync sync_ = Sync::kFree;
  std::optional<GigeControl> control_;
  std::optional<ChunkReader> chunks_;
  Owned<ArvStream> stream_;
  gulong lost_handler_ = 0;
  std::atomic<bool> lost_{false};
  bool unreachable_ = false;
  FrameGaps gaps_;
  std::optional<ArrivalClock> arrivals_{ArrivalClock()};  ///< Until images are handed on.
  GreyReader grey_;
  SteadyClock::time_point last_sign_ = SteadyClock::now();
  SteadyClock::time_point last_asked_{};
  std::optional<ActionSender> action_;
  std::unique_ptr<PeriodicTrigger> trigger_;  ///< Last: its thread uses the members above.
};

GigeCapture::~GigeCapture() {
  trigger_.reset();
  if (lost_handler_ != 0) g_signal_handler_disconnect(device(), lost_handler_);
  // Each request to a camera that is away costs seconds.
  if (stream_ && !lost_ && !unreachable_) {
    Problem problem;
    arv_camera_stop_acquisition(camera_.get(), problem.slot());
  }
  stream_.reset();
}

Result<void> GigeCapture::start(Sync sync, const LinkSetup& link) {
  sync_ = sync;
  link_ = link;
  const bool ptp = sync == Sync::kAction || sync == Sync::kPtp;
  if (options_.aravis.chunks) {
    if (const ChunkUse use = set_up_chunks(device()); use.stamp || use.exposure) {
      chunks_.emplace(camera_.get(), use);
    }
  }
  const auto features = parse_features(options_.aravis.features);
  if (!features) return features.failure();
  for (const FeatureSetting& feature : *features) {
    if (auto set = set_feature(device(), feature); !set) return set;
  }
  control_.emplace(camera_.get(), ptp);
  control_->update();
  if (auto created = create_stream(); !created) return created;
  lost_handler_ = g_signal_connect(device(), "control-lost", G_CALLBACK(on_lost), &lost_);
  Problem problem;
  arv_camera_start_acquisition(camera_.get(), problem.slot());
  if (problem) return Error{"acquisition does not start: " + problem.text()};
  last_sign_ = last_asked_ = SteadyClock::now();
  return start_trigger();
}

Result<void> GigeCapture::create_stream() {
  const AravisOptions& options = options_.aravis;
  Problem problem;
  stream_.reset(arv_camera_create_stream(camera_.get(), nullptr, nullptr, problem.slot()));
  if (!stream_) return Error{"no stream: " + problem.text()};
  const guint payload = arv_camera_get_payload(camera_.get(), problem.slot());
  if (problem) return Error{"payload: " + problem.text()};
  if (options.socket_buffer_kb > 0) {
    g_object_set(stream_.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED,
                 "socket-buffer-size", options.socket_buffer_kb * 1024, nullptr);
  } else {
    g_object_set(stream_.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_AUTO, nullptr);
  }
  g_object_set(
      stream_.get(), "packet-resend",
      options.resend ? ARV_GV_STREAM_PACKET_RESEND_ALWAYS : ARV_GV_STREAM_PACKET_RESEND_NEVER,
      nullptr);
  for (int i = 0; i < options.buffers; ++i) {
    arv_stream_push_buffer(stream_.get(), arv_buffer_new(payload, nullptr));
  }
  return {};
}

/// Begins to send triggers, where this program does.
Result<void> GigeCapture::start_trigger() {
  TriggerGrid grid;
  grid.period_ns = std::llround(1e9 / options_.trigger_rate);
  if (sync_ == Sync::kSoftware) {
    trigger_ = std::make_unique<PeriodicTrigger>(
        grid, [] { return std::int64_t{0}; },
        [this](std::int64_t) { control_->software_trigger(); });
  } else if (sync_ == Sync::kAction) {
    auto socket = GvcpSocket::open(link_.camera);
    if (!socket) return socket.failure();
    action_.emplace(std::move(*socket));
    grid.lead_ns = std::min(kLongestLeadNs, grid.period_ns / 2);
    trigger_ = std::make_unique<PeriodicTrigger>(
        grid, [this] { return control_->offset_from_monotonic(); },
        [this](std::int64_t time) { action_->send(time); });
  }
  return {};
}

CaptureState GigeCapture::gone(Capture* capture, const std::string& why) {
  capture->problem = options_.camera() + ": " + why;
  return CaptureState::kGone;
}

CaptureState GigeCapture::next(std::chrono::milliseconds timeout, Capture* capture) {
  *capture = {};
  if (lost_) return gone(capture, "the camera gave up our control of it, or is away");
  ArvBuffer* buffer = arv_stream_timeout_pop_buffer(
      stream_.get(), static_cast<guint64>(std::chrono::microseconds(timeout).count()));
  const auto now = SteadyClock::now();
  if (buffer == nullptr) return check_silence(now, capture);
  last_sign_ = now;
  CaptureState state = read(buffer, capture);
  arv_stream_push_buffer(stream_.get(), buffer);
  if (state == CaptureState::kImage && is_held_back(capture)) state = CaptureState::kNone;
  // Now, with the next trigger still some time away.
  ask_camera(now);
  return state;
}

CaptureState GigeCapture::check_silence(SteadyClock::time_point now, Capture* capture) {
  if (now - last_sign_ < kQuiet) return CaptureState::kNone;
  last_sign_ = now;
  if (!probe_.answers(kAnswerTime)) {
    unreachable_ = true;
    return gone(capture, "the camera does not answer: power or cable?");
  }
  ask_camera(now);
  return CaptureState::kNone;
}

void GigeCapture::ask_camera(SteadyClock::time_point now) {
  if (now - last_asked_ < kAskCameraEvery) return;
  last_asked_ = now;
  control_->update();
}

CaptureState GigeCapture::read(ArvBuffer* buffer, Capture* capture) {
  capture->skipped = gaps_.before(arv_buffer_get_frame_id(buffer));
  if (arv_buffer_get_status(buffer) != ARV_BUFFER_STATUS_SUCCESS) {
    capture->problem = options_.camera() +
                       ": an image lacks packets; sovo doctor looks at the receive buffer, and "
                       "camera.aravis.throughput_mbps limits cameras that share a port";
    return CaptureState::kDamaged;
  }
  const auto format = sensor_format(arv_buffer_get_image_pixel_format(buffer));
  if (!format || arv_buffer_get_image_width(buffer) != options_.width ||
      arv_buffer_get_image_height(buffer) != options_.height) {
    capture->problem = options_.camera() + ": an image of another size or format came";
    return CaptureState::kDamaged;
  }
  const auto grey = options_.pool->take();
  if (!grey) {
    capture->problem = options_.camera() + ": no free buffer: this process is too slow";
    return CaptureState::kNoRoom;
  }
  std::size_t size = 0;
  const auto* data = static_cast<const std::uint8_t*>(arv_buffer_get_image_data(buffer, &size));
  const int step = options_.width * bytes_per_grey(*format);
  if (data == nullptr ||
      !grey_.read(*format, {data, size}, options_.width, options_.height, grey->data())) {
    capture->problem = options_.camera() + ": an image has too few bytes";
    return CaptureState::kShort;
  }
  const CameraStateNow& state = control_->state();
  const double exposure = chunks_ ? chunks_->exposure_s(buffer).value_or(state.exposure.exposure_s)
                                  : state.exposure.exposure_s;
  SideImage& image = capture->image;
  image.valid = true;
  image.width = options_.width;
  image.height = options_.height;
  image.format = grey_format(*format);
  image.step = step;
  image.data = grey;
  image.exposure_s = static_cast<float>(exposure);
  image.gain_db = static_cast<float>(state.exposure.gain_db);
  fill_times(buffer, capture);
  return CaptureState::kImage;
}

/// GigE Vision cameras stamp the start of the exposure.
void GigeCapture::fill_times(ArvBuffer* buffer, Capture* capture) const {
  auto start = static_cast<std::int64_t>(arv_buffer_get_timestamp(buffer));
  if (chunks_) {
    if (const auto stamp = chunks_->stamp(buffer)) start = control_->to_ns(*stamp);
  }
  const double shift =
      0.5 * static_cast<double>(capture->image.exposure_s) + 1e-3 * options_.aravis.stamp_offset_ms;
  capture->device_ns = start + std::llround(1e9 * shift);
  capture->shared_clock = control_->state().ptp_locked;
  if (const auto& reading = control_->state().clock) {
    capture->clock_device_ns = reading->device_ns;
    capture->clock_utc_ns = reading->utc_ns;
  } else {
    capture->clock_device_ns = start;
    capture->clock_utc_ns = static_cast<std::int64_t>(arv_buffer_get_system_timestamp(buffer));
  }
}

bool GigeCapture::is_held_back(Capture* capture) {
  if (!arrivals_) return false;
  if (!control_->state().clock) {
    if (arrivals_->hold_back(capture->clock_device_ns, capture->clock_utc_ns)) return true;
    capture->clock_utc_ns = arrivals_->prompt(capture->clock_device_ns);
  }
  arrivals_.reset();
  return false;
}

Result<void> GigeCapture::set_exposure(const Exposure& exposure) {
  return control_->set_exposure(exposure);
}

std::vector<std::pair<std::string, std::string>> GigeCapture::counters() {
  guint64 completed = 0;
  guint64 failures = 0;
  guint64 underruns = 0;
  arv_stream_get_statistics(stream_.get(), &completed, &failures, &underruns);
  std::vector<std::pair<std::string, std::string>> result = {
      {"sync", to_string(sync_)},
      {"completed", std::to_string(completed)},
      {"failures", std::to_string(failures)},
      {"underruns", std::to_string(underruns)},
      {"packet_size", std::to_string(link_.packet_size)},
      {"throughput_limit_mbps", std::to_string(link_.limit_mbps)}};
  if (ARV_IS_GV_STREAM(stream_.get()) != FALSE) {
    guint64 resent = 0;
    guint64 missing = 0;
    arv_gv_stream_get_statistics(ARV_GV_STREAM(stream_.get()), &resent, &missing);
    result.emplace_back("resent_packets", std::to_string(resent));
    result.emplace_back("missing_packets", std::to_string(missing));
  }
  control_->append_counters(&result);
  if (action_) action_->append_counters(&result);
  return result;
}

std::string GigeCapture::description() const {
  return options_.camera() + " at " + link_.interface.name + ", " + std::to_string(options_.width) +
         "x" + std::to_string(options_.height) + " " + options_.aravis.pixel_format +
         ", packets of " + std::to_string(link_.packet_size) + ", sync " + to_string(sync_);
}

/// Whether both cameras are reached by the same interface.
bool is_shared(const std::vector<GigeInfo>& cameras, const GigeInfo& own,
               const std::string& other) {
  const auto found = find_camera(cameras, other);
  return found && !own.interface.empty() && found->interface == own.interface;
}

Result<std::unique_ptr<CaptureDevice>> open_found(const GigeOptions& options, const GigeInfo& info,
                                                  bool shared) {
  const auto alone = options.network->alone();
  auto camera = open_camera(info);
  if (!camera) return camera.failure();
  ArvDevice* device = arv_camera_get_device(camera->get());
  const auto sync =
      options.sync->choose(options.side, sync_ability(device, options.aravis.trigger_source));
  if (!sync) return sync.failure();
  if (auto set = set_up_image(camera->get(), options); !set) return set.failure();
  if (auto set = set_up_sync(device, *sync, options.aravis.trigger_source); !set) {
    return set.failure();
  }
  const auto link = set_up_link(camera->get(), options.aravis, shared);
  if (!link) return link.failure();
  auto probe = GvcpSocket::open(link->camera);
  if (!probe) return probe.failure();
  auto capture = std::make_unique<GigeCapture>(std::move(*camera), options, std::move(*probe));
  if (auto started = capture->start(*sync, *link); !started) return started.failure();
  return std::unique_ptr<CaptureDevice>(std::move(capture));
}

}  // namespace

Result<GigeProbe> probe_gige(const GigeOptions& options, const GigeInfo& info) {
  const auto alone = options.network->alone();
  const auto camera = open_camera(info);
  if (!camera) return named(options.camera(), camera.failure());
  ArvDevice* device = arv_camera_get_device(camera->get());
  if (auto set = set_up_image(camera->get(), options); !set) {
    return named(options.camera(), set.failure());
  }
  const auto features = parse_features(options.aravis.features);
  if (!features) return features.failure();
  for (const FeatureSetting& feature : *features) {
    if (auto set = set_feature(device, feature); !set) {
      return named(options.camera(), set.failure());
    }
  }
  GigeProbe probe;
  probe.ability = sync_ability(device, options.aravis.trigger_source);
  Problem problem;
  const double rate = arv_camera_get_frame_rate(camera->get(), problem.slot());
  if (!problem && std::isfinite(rate) && rate > 0.0) probe.frame_rate = rate;
  return probe;
}

Result<std::unique_ptr<CaptureDevice>> open_gige(const GigeOptions& options) {
  const auto cameras = options.network->cameras();
  const auto info = find_camera(cameras, options.camera());
  if (!info) return info.failure();
  auto opened = open_found(options, *info, is_shared(cameras, *info, options.other_camera()));
  if (!opened) return named(options.camera(), opened.failure());
  return opened;
}

}  // namespace sovo::aravis
