#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "sovo/bridge/cdr_sample.h"
#include "sovo/bridge/ros_image_converter.h"
#include "sovo/bridge/session_lock.h"
#include "sovo/bridge/topic_capture.h"
#include "sovo/io/recording_writer.h"

namespace sovo::bridge {

/// How a recording stands.
struct RecordingState {
  bool recording = false;
  std::string file;
  std::string reason;   ///< Why it is not recording; empty before the first one.
  bool failed = false;  ///< It ended by itself.
  std::uint64_t messages = 0;
  std::uint64_t bytes = 0;
  std::uint64_t queued_bytes = 0;
  std::uint64_t dropped = 0;  ///< Messages: not taken in time, or missing in a sequence.
  std::map<std::string, std::uint64_t> drops;  ///< By topic.
};

/// Writes captured messages to disk on a thread of its own, behind a bounded queue: `push` never
/// waits for the disk.
class RecordingThread {
 public:
  /// `queue_bytes`: what may wait; beyond, messages are dropped and counted.
  /// `stereo_topic`: its frames are written as Image and CameraInfo; empty: as they are.
  explicit RecordingThread(std::uint64_t queue_bytes, const std::string& stereo_topic = {});
  ~RecordingThread();

  /// Begins a recording; messages pushed from now on are in it, after those of latched topics that
  /// a late reader would get.
  Result<void> start(const std::string& path, const RecordingConfig& config);
  /// Writes what waits and finishes the files; `reason` for the state.
  void stop(const std::string& reason);
  /// Takes a message received at `log_ns` while recording.
  void push(const std::shared_ptr<const CapturedTopic>& topic, CdrSample sample,
            std::int64_t log_ns);

  RecordingState state() const;

 private:
  struct Item {
    std::shared_ptr<const CapturedTopic> topic;
    CdrSample sample;
    std::int64_t log_ns;
  };

  void keep_latched(const std::shared_ptr<const CapturedTopic>& topic, const CdrSample& sample);
  void queue_latched();
  void run();
  Result<void> write(const Item& item);
  Result<void> write_as(const RecordingTopic& topic, const Item& item, CdrBytes bytes);
  Result<void> write_images(const Item& item);
  void count_drop(const std::string& topic);
  Result<void> work(std::deque<Item> items);
  void attach_calibration(const Item& item);
  void count_gaps(const std::string& topic, CdrBytes frame);
  void finish(const std::string& reason, bool failed);

  const std::uint64_t queue_bytes_;

  mutable std::mutex mutex_;  // of everything down to `stop_reason_`
  std::condition_variable changed_;
  std::deque<Item> queue_;
  RecordingState state_;
  std::map<std::shared_ptr<const CapturedTopic>, std::deque<CdrSample>> latched_;
  std::map<std::string, GapCounter> gaps_;
  std::uint64_t gap_session_ = 0;
  bool ending_ = false;
  std::optional<std::string> stop_reason_;

  // Of the writing thread while it runs.
  std::unique_ptr<RecordingWriter> writer_;
  std::unique_ptr<RosImageConverter> converter_;  // null: frames are written as they are
  bool has_calibration_ = false;
  std::thread thread_;
};

}  // namespace sovo::bridge
