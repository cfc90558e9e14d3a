#include "sovo/driver/live/camera_worker.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sovo {
namespace {

/// How long a wait for an image lasts before the thread looks whether it shall stop.
constexpr std::chrono::milliseconds kSlice(100);
constexpr std::chrono::seconds kRateWindow(2);
constexpr std::chrono::seconds kAskEvery(1);
constexpr std::uint8_t kPtpClock = 2;  // of StereoFrame::clock

double seconds(std::chrono::steady_clock::duration d) {
  return std::chrono::duration<double>(d).count();
}

}  // namespace

const char* to_string(CameraState state) {
  switch (state) {
    case CameraState::kOpening:
      return "opening";
    case CameraState::kStreaming:
      return "streaming";
    case CameraState::kLost:
      return "lost";
  }
  return "?";
}

CameraWorker::CameraWorker(CameraWorkerConfig config, Open open, Deliver deliver,
                           ClockSet clock_set)
    : config_(std::move(config)),
      open_(std::move(open)),
      deliver_(std::move(deliver)),
      clock_set_(std::move(clock_set)),
      clock_(config_.clock),
      backoff_(config_.backoff, config_.longest) {
  report_.name = config_.name;
  thread_ = std::thread([this] { run(); });
}

CameraWorker::~CameraWorker() {
  {
    const std::scoped_lock lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

CameraReport CameraWorker::report() const {
  const std::scoped_lock lock(mutex_);
  return report_;
}

void CameraWorker::request(const Exposure& exposure) {
  const std::scoped_lock lock(mutex_);
  request_ = exposure;
}

bool CameraWorker::stopping() const {
  const std::scoped_lock lock(mutex_);
  return stop_;
}

void CameraWorker::wait(std::chrono::milliseconds time) {
  std::unique_lock lock(mutex_);
  wake_.wait_for(lock, time, [this] { return stop_; });
}

void CameraWorker::run() {
  while (!stopping()) {
    const auto device = open_device();
    if (device) {
      stream(device.get());
    } else {
      wait(backoff_.next());
    }
  }
}

std::unique_ptr<CaptureDevice> CameraWorker::open_device() {
  auto device = open_();
  const std::scoped_lock lock(mutex_);
  if (!device) {
    ++report_.counts.open_failures;
    report_.message = device.error();
    return nullptr;
  }
  report_.device = (*device)->description();
  first_since_open_ = true;
  return std::move(*device);
}

void CameraWorker::stream(CaptureDevice* device) {
  Capture capture;
  auto last_sign = Clock::now();
  while (!stopping()) {
    apply_request(device);
    const CaptureState state = device->next(kSlice, &capture);
    const auto now = Clock::now();
    if (state == CaptureState::kNone) {
      if (now - last_sign < config_.stall) continue;
      lose(&CameraCounts::stalls, "no image for " + std::to_string(config_.stall.count()) +
                                      " ms; it is opened anew. If this goes on, see whether the "
                                      "cable or the hub has the bandwidth for this mode");
      return;
    }
    if (state == CaptureState::kGone) {
      lose(&CameraCounts::disconnects, capture.problem);
      // A device that vanishes leaves its node for a moment.
      wait(backoff_.next());
      return;
    }
    last_sign = now;
    if (state == CaptureState::kImage) {
      if (first_since_open_) found();
      handle_image(&capture);
      ask_device(device, now);
    } else {
      handle_bad(state, capture);
    }
  }
}

/// What the device knows of itself, once a second.
void CameraWorker::ask_device(CaptureDevice* device, Clock::time_point now) {
  if (now - last_asked_ < kAskEvery) return;
  last_asked_ = now;
  auto counters = device->counters();
  const auto temperature = device->temperature();
  const std::scoped_lock lock(mutex_);
  report_.stream = std::move(counters);
  report_.temperature_c = temperature;
}

void CameraWorker::apply_request(CaptureDevice* device) {
  std::optional<Exposure> request;
  {
    const std::scoped_lock lock(mutex_);
    request = std::exchange(request_, std::nullopt);
  }
  if (!request) return;
  if (auto set = device->set_exposure(*request); !set) {
    const std::scoped_lock lock(mutex_);
    report_.message = set.error();
  }
}

/// The first image after an opening.
void CameraWorker::found() {
  const auto now = Clock::now();
  first_since_open_ = false;
  backoff_.reset();
  rate_since_ = now;
  rate_images_ = 0;
  const std::scoped_lock lock(mutex_);
  if (last_image_) {
    ++report_.counts.reconnects;
    report_.downtime_s = seconds(now - *last_image_);
    // What the camera would have made meanwhile shows as a gap in the sequence.
    next_sequence_ += static_cast<std::uint64_t>(
        std::max(1.0, std::round(report_.downtime_s * config_.frame_rate) - 1.0));
  }
  report_.state = CameraState::kStreaming;
  report_.message.clear();
}

void CameraWorker::handle_image(Capture* capture) {
  const std::uint64_t steps = clock_.steps();
  clock_.observe(capture->clock_device_ns, capture->clock_utc_ns);
  if (clock_.steps() != steps || capture->shared_clock != ptp_) clock_set_();
  ptp_ = capture->shared_clock;
  const auto now = Clock::now();
  last_image_ = now;
  next_sequence_ += capture->skipped;
  TimedImage image;
  image.stamp_ns = clock_.to_utc(capture->device_ns);
  image.time_ns = config_.shared_clock || ptp_ ? capture->device_ns : image.stamp_ns;
  image.stamp_sigma_s = clock_.sigma_s();
  image.sequence = next_sequence_++;
  image.clock = ptp_ ? kPtpClock : config_.clock_kind;
  image.image = std::move(capture->image);
  image.colour = std::move(capture->colour);
  {
    const std::scoped_lock lock(mutex_);
    CameraCounts& counts = report_.counts;
    ++counts.images;
    counts.skipped += capture->skipped;
    counts.clock_steps = clock_.steps();
    report_.clock_drift = clock_.drift();
    report_.clock_sigma_s = clock_.sigma_s();
    image.image.dropped = counts.dropped();
    capture->right.dropped = counts.dropped();
    measure_rate(now);
  }
  deliver_(std::move(image), {std::move(capture->right), std::move(capture->right_colour)});
}

/// Called with the mutex held.
void CameraWorker::measure_rate(Clock::time_point now) {
  ++rate_images_;
  if (now - rate_since_ < kRateWindow) return;
  report_.rate_hz = static_cast<double>(rate_images_) / seconds(now - rate_since_);
  rate_since_ = now;
  rate_images_ = 0;
}

void CameraWorker::handle_bad(CaptureState state, const Capture& capture) {
  next_sequence_ += capture.skipped + 1;
  const std::scoped_lock lock(mutex_);
  CameraCounts& counts = report_.counts;
  counts.skipped += capture.skipped;
  if (state == CaptureState::kDamaged) ++counts.damaged;
  if (state == CaptureState::kShort) ++counts.short_images;
  if (state == CaptureState::kNoRoom) ++counts.no_room;
  report_.message = capture.problem;
}

void CameraWorker::lose(std::uint64_t CameraCounts::*counter, const std::string& message) {
  const std::scoped_lock lock(mutex_);
  ++(report_.counts.*counter);
  if (report_.state == CameraState::kStreaming) report_.state = CameraState::kLost;
  report_.rate_hz = 0.0;
  report_.message = message;
}

}  // namespace sovo
