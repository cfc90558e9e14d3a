#include "sovo/app/loop_sink.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

namespace sovo::app {
namespace {

constexpr std::size_t kMostWaiting = 10;
constexpr double kNanosecond = 1e-9;
constexpr double kWorthTelling = 0.1;  // a correction of so many metres

}  // namespace

KeyframeOutput needed_for_loops(const KeyframeOutput& keyframe) {
  KeyframeOutput out;
  out.id = keyframe.id;
  out.segment = keyframe.segment;
  out.stamp_ns = keyframe.stamp_ns;
  out.revised = keyframe.revised;
  out.scale_valid = keyframe.scale_valid;
  out.T_odom_left = keyframe.T_odom_left;
  if (keyframe.revised) return out;
  out.inverse_depth = keyframe.inverse_depth;
  out.covariance = keyframe.covariance;
  out.left = keyframe.left;
  out.right = keyframe.right;
  out.T_later_left = keyframe.T_later_left;
  out.halvings = keyframe.halvings;
  out.co_moving_mask = keyframe.co_moving_mask;
  return out;
}

LoopSink::LoopSink(const LoopConfig& config, const StaticMatcherConfig& matcher, bool background,
                   OnPlace on_place)
    : config_(config), matcher_(matcher), on_place_(std::move(on_place)) {
  if (!background) return;
  worker_ = std::make_unique<bridge::BackgroundWorker>("sovo-loops", std::chrono::seconds(1),
                                                       [this] { work(); });
}

void LoopSink::begin(const StereoOdometry& odometry) {
  bool anew = false;
  {
    const std::scoped_lock lock(closer_mutex_, queue_mutex_);
    queue_.clear();
    counts_ = {};
    anew = closer_ != nullptr;
    closer_ = std::make_unique<LoopCloser>(config_, matcher_, odometry.tracked_rig(),
                                           odometry.tracked_mask());
  }
  if (anew && on_place_) on_place_({});
}

void LoopSink::on_keyframe(const KeyframeOutput& keyframe) {
  if (!worker_) {
    take(keyframe);
    return;
  }
  {
    const std::lock_guard lock(queue_mutex_);
    queue_.push_back(needed_for_loops(keyframe));
    // Revisions hold no images, and must not be lost.
    const auto is_new = [](const KeyframeOutput& k) { return !k.revised; };
    if (static_cast<std::size_t>(std::count_if(queue_.begin(), queue_.end(), is_new)) >
        kMostWaiting) {
      queue_.erase(std::find_if(queue_.begin(), queue_.end(), is_new));
      ++dropped_;
    }
  }
  worker_->wake();
}

void LoopSink::work() {
  for (;;) {
    KeyframeOutput next;
    {
      const std::lock_guard lock(queue_mutex_);
      if (queue_.empty()) return;
      next = std::move(queue_.front());
      queue_.pop_front();
    }
    take(next);
  }
}

void LoopSink::take(const KeyframeOutput& keyframe) {
  Map map;
  {
    const std::lock_guard lock(closer_mutex_);
    if (!closer_) return;
    const std::uint64_t places = closer_->counts().places;
    map.closure = closer_->add(keyframe);
    set_counts(closer_->counts());
    if (closer_->counts().places == places) return;
    map.T_map_odom = closer_->T_map_odom();
    if (on_place_) map.places = closer_->corrected_places();
  }
  if (map.closure) {
    const LoopClosure& c = *map.closure;
    const double seconds = kNanosecond * static_cast<double>(c.newer_stamp_ns - c.older_stamp_ns);
    spdlog::log(c.moved_m > kWorthTelling ? spdlog::level::info : spdlog::level::debug,
                "loop closed over {:.1f} s: {} landmarks agree, map moves by {:.3f} m", seconds,
                c.inliers, c.moved_m);
  }
  if (on_place_) on_place_(map);
}

void LoopSink::set_counts(const LoopCounts& counts) {
  const std::lock_guard lock(queue_mutex_);
  counts_ = counts;
}

void LoopSink::finish() {
  worker_.reset();
  work();
  const std::lock_guard lock(closer_mutex_);
  if (closer_) closer_->finish();
}

std::vector<TrajectoryPose> LoopSink::corrected(std::vector<TrajectoryPose> trajectory) const {
  const std::lock_guard lock(closer_mutex_);
  return closer_ ? closer_->corrected(std::move(trajectory)) : trajectory;
}

LoopCounts LoopSink::counts() const {
  const std::lock_guard lock(queue_mutex_);
  return counts_;
}

std::uint64_t LoopSink::dropped() const {
  const std::lock_guard lock(queue_mutex_);
  return dropped_;
}

}  // namespace sovo::app
