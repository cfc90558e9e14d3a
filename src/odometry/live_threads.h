#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "sovo/image/stereo_frame.h"
#include "sovo/odometry/map_segment.h"

namespace sovo {

/// A tracked frame on its way to mapping.
struct MappingJob {
  TrackedFrame tracked;
  std::optional<SideImage> right;
};

/// The mapping thread and the scale thread of live operation. Corrections of scale are applied by
/// the mapping thread between two of its steps.
class LiveThreads {
 public:
  struct Callbacks {
    std::function<void(const MappingOutcome&)> on_mapped;
    std::function<void(const ScaleRecord&)> on_scale;
  };

  LiveThreads(std::size_t queue_limit, Callbacks callbacks);
  ~LiveThreads();
  LiveThreads(const LiveThreads&) = delete;
  LiveThreads& operator=(const LiveThreads&) = delete;

  /// The segment that jobs belong to; waits until all work on the former one is done.
  void set_segment(MapSegment* segment);

  /// Queues a frame. `wait`: waits while the queue is full, and for keyframes until they are
  /// mapped. Otherwise, with a full queue, drops the oldest frame that does not want to be a
  /// keyframe and returns false.
  bool push(MappingJob job, bool wait);

  /// Waits until nothing is queued or under way.
  void drain();

  std::size_t queue_depth() const;
  /// Whether the map broke down; cleared by `set_segment`.
  bool map_failed() const;

 private:
  void run_mapping();
  void run_scale();
  bool idle() const;

  const std::size_t queue_limit_;
  Callbacks callbacks_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  MapSegment* segment_ = nullptr;
  std::deque<MappingJob> queue_;
  std::unique_ptr<ScaleJob> scale_job_;  ///< The newest keyframe's; an older unserved one goes.
  struct ScaleResult {
    std::unique_ptr<ScaleJob> job;
    ScaleEstimate estimate;
  };
  std::optional<ScaleResult> scale_result_;
  bool mapping_busy_ = false;
  bool scale_busy_ = false;
  bool map_failed_ = false;
  bool stop_ = false;
  std::thread mapping_thread_;
  std::thread scale_thread_;
};

}  // namespace sovo
