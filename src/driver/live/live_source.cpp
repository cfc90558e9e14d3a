#include "sovo/driver/live/live_source.h"

#include <cstdlib>
#include <utility>

namespace sovo {
LiveSource::LiveSource(StereoRig rig, const LiveSourceConfig& config,
                       std::vector<LiveCamera> cameras)
    : rig_(std::move(rig)),
      colour_wanted_(config.colour_wanted),
      pairer_(config.pair_tolerance_ns, config.max_waiting) {
  if (config.auto_exposure) auto_exposure_.emplace(*config.auto_exposure);
  const bool both = cameras.size() == 1;
  workers_.reserve(cameras.size());
  for (LiveCamera& camera : cameras) {
    const auto side = workers_.empty() ? CameraSide::kLeft : CameraSide::kRight;
    const auto deliver = [this, both, side](TimedImage image, RightImage right) {
      if (both) {
        take_both(std::move(image), std::move(right));
      } else {
        take_side(side, std::move(image));
      }
    };
    const auto clock_set = [this] {
      const std::scoped_lock lock(mutex_);
      pairer_.restart();
    };
    workers_.push_back(
        std::make_unique<CameraWorker>(camera.config, std::move(camera.open), deliver, clock_set));
  }
}

LiveSource::~LiveSource() { workers_.clear(); }

LiveSource::Queued LiveSource::to_queued(StereoPair pair) {
  Queued queued;
  StereoFrame& frame = queued.frame;
  frame.stamp_ns = pair.left.stamp_ns;
  frame.sequence = pair.left.sequence;
  frame.clock = pair.left.clock;
  frame.stamp_sigma_s = pair.left.stamp_sigma_s;
  frame.left = std::move(pair.left.image);
  queued.colour.left = std::move(pair.left.colour);
  if (pair.right) {
    const std::int64_t offset = pair.right->time_ns - pair.left.time_ns;
    frame.pair_error_s = 1e-9 * static_cast<double>(std::abs(offset));
    frame.right = std::move(pair.right->image);
    frame.right.stamp_offset_ns = offset;
    queued.colour.right = std::move(pair.right->colour);
  }
  return queued;
}

void LiveSource::take_both(TimedImage image, RightImage right) {
  StereoPair pair{std::move(image), std::nullopt};
  if (right.image.valid) {
    pair.right = pair.left;
    pair.right->image = std::move(right.image);
    pair.right->colour = std::move(right.colour);
  }
  const std::scoped_lock lock(mutex_);
  push(std::move(pair));
}

void LiveSource::take_side(CameraSide side, TimedImage image) {
  const std::scoped_lock lock(mutex_);
  pairer_.add(side, std::move(image));
  while (auto pair = pairer_.next()) push(std::move(*pair));
}

/// Called with the mutex held.
void LiveSource::push(StereoPair pair) {
  if (count_ == kQueue) {
    ++report_.queue_dropped;
    head_ = (head_ + 1) % kQueue;
    --count_;
  }
  queue_[(head_ + count_) % kQueue] = to_queued(std::move(pair));
  ++count_;
  arrived_.notify_one();
}

void LiveSource::want_colour(bool wanted) {
  if (colour_wanted_) *colour_wanted_ = wanted;
}

SourceResult LiveSource::next(std::chrono::milliseconds timeout) {
  SourceResult result;
  colour_ = {};
  {
    std::unique_lock lock(mutex_);
    if (!arrived_.wait_for(lock, timeout, [this] { return count_ > 0; })) return result;
    result.frame = std::move(queue_[head_].frame);
    colour_ = std::move(queue_[head_].colour);
    queue_[head_] = {};
    head_ = (head_ + 1) % kQueue;
    --count_;
    ++report_.frames;
    report_.pair_error_s = result.frame.pair_error_s;
    report_.exposure_s = result.frame.left.exposure_s;
    report_.gain_db = result.frame.left.gain_db;
  }
  result.state = SourceState::kFrame;
  if (auto_exposure_) control_exposure(result.frame);
  return result;
}

/// Both cameras get the same exposure and gain.
void LiveSource::control_exposure(const StereoFrame& frame) {
  const auto wanted = auto_exposure_->observe(frame);
  if (wanted) {
    for (const auto& worker : workers_) worker->request(*wanted);
  }
  const std::scoped_lock lock(mutex_);
  report_.mean_grey = auto_exposure_->mean_grey();
}

LiveReport LiveSource::report() const {
  LiveReport report;
  {
    const std::scoped_lock lock(mutex_);
    report = report_;
    report.pairs = pairer_.counts();
  }
  for (const auto& worker : workers_) report.cameras.push_back(worker->report());
  return report;
}

}  // namespace sovo
