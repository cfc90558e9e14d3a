#include "sovo/bridge/recording_thread.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

#include "sovo/bridge/calibration_conversion.h"
#include "sovo/bridge/cdr_codec.h"
#include "sovo/bridge/frame_number.h"
#include "sovo/io/calibration.h"

namespace sovo::bridge {
namespace {

constexpr std::chrono::milliseconds kTick(100);

bool is(const CapturedTopic& topic, const char* type) { return topic.about.type == type; }

}  // namespace

RecordingThread::RecordingThread(std::uint64_t queue_bytes, const std::string& stereo_topic)
    : queue_bytes_(queue_bytes) {
  if (!stereo_topic.empty()) converter_ = std::make_unique<RosImageConverter>(stereo_topic);
}

RecordingThread::~RecordingThread() { stop("the recorder ended"); }

Result<void> RecordingThread::start(const std::string& path, const RecordingConfig& config) {
  stop("another recording begins");
  auto writer = RecordingWriter::create(path, config);
  const std::lock_guard lock(mutex_);
  if (!writer) {
    state_.reason = writer.error();
    state_.failed = true;
    return writer.failure();
  }
  writer_ = std::move(*writer);
  has_calibration_ = false;
  gaps_.clear();
  queue_.clear();
  state_ = {};
  state_.recording = true;
  state_.file = writer_->file();
  ending_ = false;
  stop_reason_.reset();
  queue_latched();
  thread_ = std::thread([this] { run(); });
  return {};
}

void RecordingThread::stop(const std::string& reason) {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    if (!stop_reason_) stop_reason_ = reason;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

void RecordingThread::push(const std::shared_ptr<const CapturedTopic>& topic, CdrSample sample,
                           std::int64_t log_ns) {
  const std::lock_guard lock(mutex_);
  if (topic->qos.latched) keep_latched(topic, sample);
  if (!state_.recording || ending_) return;
  const std::string& name = topic->about.topic;
  if (is(*topic, MessageTraits<msg::StereoFrame>::kRosName)) count_gaps(name, sample.bytes());
  const std::uint64_t size = sample.bytes().size();
  if (state_.queued_bytes + size > queue_bytes_) {
    ++state_.drops[name];
    ++state_.dropped;
    return;
  }
  state_.queued_bytes += size;
  queue_.push_back({topic, std::move(sample), log_ns});
  changed_.notify_all();
}

/// Samples of latched topics come once; a recording that begins later needs them too.
void RecordingThread::keep_latched(const std::shared_ptr<const CapturedTopic>& topic,
                                   const CdrSample& sample) {
  std::deque<CdrSample>& kept = latched_[topic];
  kept.push_back(sample);
  if (kept.size() > static_cast<std::size_t>(std::max(topic->qos.depth, 1))) kept.pop_front();
}

void RecordingThread::queue_latched() {
  const std::int64_t now = dds_time();
  for (const auto& [topic, samples] : latched_) {
    for (const CdrSample& sample : samples) {
      state_.queued_bytes += sample.bytes().size();
      queue_.push_back({topic, sample, now});
    }
  }
}

/// Frames that never arrived are missing in the recording, too.
void RecordingThread::count_gaps(const std::string& topic, CdrBytes frame) {
  const auto number = frame_number(frame);
  if (!number) return;
  GapCounter& gaps = gaps_[topic];
  if (number->session != std::exchange(gap_session_, number->session)) gaps.restart();
  const std::uint64_t before = gaps.lost();
  gaps.count(number->sequence);
  const std::uint64_t lost = gaps.lost() - before;
  if (lost == 0) return;
  state_.drops[topic] += lost;
  state_.dropped += lost;
}

RecordingState RecordingThread::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

void RecordingThread::run() {
  while (true) {
    std::deque<Item> items;
    bool last = false;
    {
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, kTick, [&] { return !queue_.empty() || ending_; });
      items.swap(queue_);
      last = ending_;
      writer_->set_drops(state_.drops);
    }
    Result<void> done;
    try {
      done = work(std::move(items));
    } catch (const std::exception& e) {
      done = Error{std::string("recording failed: ") + e.what()};
    }
    if (!done) return finish(done.error(), true);
    if (last) return finish(*stop_reason_, false);
  }
}

Result<void> RecordingThread::work(std::deque<Item> items) {
  for (; !items.empty(); items.pop_front()) {
    if (auto done = write(items.front()); !done) return done;
    const std::lock_guard lock(mutex_);
    state_.queued_bytes -= items.front().sample.bytes().size();
    ++state_.messages;
    state_.bytes = writer_->bytes();
    state_.file = writer_->file();
  }
  return writer_->tick();
}

Result<void> RecordingThread::write(const Item& item) {
  if (!has_calibration_) attach_calibration(item);
  const std::string& name = item.topic->about.topic;
  if (converter_) {
    if (name == converter_->stereo_topic()) return write_images(item);
    if (converter_->makes(name)) return {};  // once is enough
    if (is(*item.topic, MessageTraits<msg::StereoCalibration>::kRosName)) {
      (void)converter_->take_calibration(item.sample.bytes());  // a bad one gives no camera_info
    }
  }
  return write_as(item.topic->about, item, item.sample.bytes());
}

Result<void> RecordingThread::write_as(const RecordingTopic& topic, const Item& item,
                                       CdrBytes bytes) {
  auto done = writer_->write(writer_->topic_number(topic), static_cast<std::uint64_t>(item.log_ns),
                             static_cast<std::uint64_t>(item.sample.source_stamp_ns()), bytes);
  if (!done) return done;
  return writer_->tick();
}

Result<void> RecordingThread::write_images(const Item& item) {
  const auto messages = converter_->convert(item.sample.bytes());
  if (!messages) {
    count_drop(item.topic->about.topic);
    return {};
  }
  for (const auto& message : *messages) {
    if (auto done = write_as(*message.topic, item, message.data); !done) return done;
  }
  return {};
}

void RecordingThread::count_drop(const std::string& topic) {
  const std::lock_guard lock(mutex_);
  ++state_.drops[topic];
  ++state_.dropped;
}

/// The first calibration is attached in the form of a calibration file.
void RecordingThread::attach_calibration(const Item& item) {
  if (!is(*item.topic, MessageTraits<msg::StereoCalibration>::kRosName)) return;
  const auto message = decode<msg::StereoCalibration>(item.sample.bytes());
  if (!message) return;
  const auto cameras = from_message(**message);
  if (!cameras) return;
  const std::string text = format_sovo_calibration(cameras->rig);
  has_calibration_ =
      writer_
          ->attach("calibration.yaml", "application/yaml", static_cast<std::uint64_t>(item.log_ns),
                   Bytes(text.begin(), text.end()))
          .ok();
}

void RecordingThread::finish(const std::string& reason, bool failed) {
  const auto closed = writer_->close();
  const std::lock_guard lock(mutex_);
  state_.bytes = writer_->bytes();
  state_.recording = false;
  state_.failed = failed || !closed;
  state_.reason = !failed && !closed ? closed.error() : reason;
  state_.queued_bytes = 0;
  queue_.clear();
}

}  // namespace sovo::bridge
