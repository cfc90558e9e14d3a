#include "sovo/bridge/stereo_subscriber.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "sovo/bridge/stereo_frame_conversion.h"
#include "sovo/bridge/topics.h"

namespace sovo::bridge {
namespace {

using namespace std::chrono_literals;

constexpr auto kPoll = 20ms;                 // of calibrations; frames wake the thread at once
constexpr std::size_t kMostPublishers = 32;  // remembered; a flood of them takes no memory
constexpr std::size_t kMostReports = 16;     // waiting to be read

bool same(const CameraModel& a, const CameraModel& b) {
  return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy &&
         a.cx == b.cx && a.cy == b.cy && a.distortion == b.distortion && a.d == b.d;
}

bool same(const PhotometricCalibration& a, const PhotometricCalibration& b) {
  return a.inverse_response == b.inverse_response && a.vignette.size() == b.vignette.size() &&
         std::equal(a.vignette.data(), a.vignette.data() + a.vignette.size(), b.vignette.data());
}

bool same(const StereoCameras& a, const StereoCameras& b) {
  return same(a.rig.left, b.rig.left) && same(a.rig.right, b.rig.right) &&
         a.rig.T_right_left.matrix() == b.rig.T_right_left.matrix() &&
         a.rig.T_base_left.matrix() == b.rig.T_base_left.matrix() &&
         same(a.left_photometric, b.left_photometric) &&
         same(a.right_photometric, b.right_photometric);
}

struct EndpointDeleter {
  void operator()(dds_builtintopic_endpoint_t* endpoint) const {
    dds_builtintopic_free_endpoint(endpoint);
  }
};
using EndpointPtr = std::unique_ptr<dds_builtintopic_endpoint_t, EndpointDeleter>;

/// Participant of a matched writer; nothing when it has gone.
std::optional<std::uint64_t> participant_of(dds_entity_t reader, dds_instance_handle_t writer) {
  const EndpointPtr endpoint(dds_get_matched_publication_data(reader, writer));
  if (!endpoint) return std::nullopt;
  return endpoint->participant_instance_handle;
}

bool has_writer_of(dds_entity_t reader, std::uint64_t publisher) {
  std::array<dds_instance_handle_t, kMostPublishers> writers{};
  const dds_return_t count = dds_get_matched_publications(reader, writers.data(), writers.size());
  const auto end = writers.begin() + std::clamp<std::ptrdiff_t>(count, 0, writers.size());
  return std::any_of(writers.begin(), end, [&](dds_instance_handle_t writer) {
    return writer == publisher || participant_of(reader, writer) == publisher;
  });
}

}  // namespace

Result<std::unique_ptr<StereoSubscriber>> StereoSubscriber::open(
    const Participant& participant, const StereoSubscriberConfig& config,
    std::optional<StereoCameras> calibration) {
  auto frames = Reader<msg::StereoFrame>::open(participant, topics::kStereo, topics::kStereoQos);
  if (!frames) return frames.failure();
  auto calibrations = Reader<msg::StereoCalibration>::open(participant, topics::kCalibration,
                                                           topics::kCalibrationQos);
  if (!calibrations) return calibrations.failure();
  std::unique_ptr<StereoSubscriber> source(
      new StereoSubscriber(std::move(*frames), std::move(*calibrations), config));
  source->calibration_given_ = calibration.has_value();
  source->cameras_ = std::move(calibration);
  source->thread_ = std::thread([raw = source.get()] { raw->receive(); });
  return source;
}

StereoSubscriber::~StereoSubscriber() {
  stopping_ = true;
  frames_.wake();
  if (thread_.joinable()) thread_.join();
}

Result<void> StereoSubscriber::wait_for_calibration(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, timeout, [&] { return cameras_.has_value() || woken_; });
  woken_ = false;
  if (cameras_) return {};
  if (!calibration_error_.empty()) return Error{calibration_error_};
  return Error{"no calibration on " + calibrations_.topic() +
               ": start a camera process with the same domain, network and namespace, or give the "
               "calibration as a file"};
}

SourceResult StereoSubscriber::next(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, timeout, [&] { return !queue_.empty() || woken_; });
  woken_ = false;
  if (queue_.empty()) return {};
  Item item = std::move(queue_.front());
  queue_.pop_front();
  if (item.latency_origin_ns != 0) latency_origin_ns_ = item.latency_origin_ns;
  return std::move(item.result);
}

void StereoSubscriber::wake() {
  const std::lock_guard lock(mutex_);
  woken_ = true;
  changed_.notify_all();
}

FeedCounters StereoSubscriber::counters() const {
  const std::lock_guard lock(mutex_);
  return counters_;
}

void StereoSubscriber::receive() {
  while (!stopping_) {
    try {
      frames_.wait(kPoll);
      if (!calibration_given_) take_calibrations();
      const auto taken = frames_.take_each(
          [&](const msg::StereoFrame& m, const dds_sample_info_t& info) { take_frame(m, info); });
      if (!taken) {
        report(SourceState::kFailed, taken.error());
        return;
      }
    } catch (const std::exception& e) {
      report(SourceState::kFailed, std::string("receiving stereo frames failed: ") + e.what());
      return;
    }
  }
}

void StereoSubscriber::take_calibrations() {
  bool news = false;
  (void)calibrations_.take_each(
      [&](const msg::StereoCalibration& message, const dds_sample_info_t& info) {
        const std::uint64_t publisher = publisher_of(calibrations_, info.publication_handle);
        lock_.prefer(publisher, [&](std::uint64_t p) { return is_alive(p); });
        auto cameras = from_message(message);
        if (!cameras) {
          if (lock_.publisher() != publisher) return;
          const std::string text = "calibration refused: " + cameras.error();
          report(SourceState::kBadFrame, text);
          const std::lock_guard lock(mutex_);
          calibration_error_ = text;
          return;
        }
        if (heard_.size() >= kMostPublishers) heard_.clear();
        heard_.insert_or_assign(publisher, std::move(*cameras));
        news = true;
      });
  if (news) use_calibration_of_followed();
}

/// The first calibration of the followed publisher is the one of the whole run.
void StereoSubscriber::use_calibration_of_followed() {
  const auto publisher = lock_.publisher();
  const auto heard = publisher ? heard_.find(*publisher) : heard_.end();
  if (heard == heard_.end()) return;
  bool changed = false;
  {
    const std::lock_guard lock(mutex_);
    if (!cameras_) {
      cameras_ = heard->second;
      changed_.notify_all();
    } else {
      changed = !same(*cameras_, heard->second);
    }
  }
  if (changed) {
    report(SourceState::kFailed, "the calibration on " + calibrations_.topic() +
                                     " is another one than at the start: start the odometry again");
  }
}

void StereoSubscriber::take_frame(const msg::StereoFrame& message, const dds_sample_info_t& info) {
  using Verdict = SessionLock::Verdict;
  const std::uint64_t publisher = publisher_of(frames_, info.publication_handle);
  const Verdict verdict =
      lock_.judge(publisher, message.session, [&](std::uint64_t p) { return is_alive(p); });
  if (verdict == Verdict::kForeign || verdict == Verdict::kNewForeign) {
    if (verdict == Verdict::kNewForeign) {
      report(SourceState::kBadFrame, "a second publisher writes to " + frames_.topic() +
                                         " (session " + std::to_string(message.session) +
                                         "): its frames are ignored; stop it or give it another "
                                         "namespace with --ns");
    }
    const std::lock_guard lock(mutex_);
    counters_.foreign = lock_.foreign_frames();
    return;
  }
  if (verdict == Verdict::kSwitched) {
    gaps_.restart();
    use_calibration_of_followed();
  }
  accept(message, info.source_timestamp);
}

void StereoSubscriber::accept(const msg::StereoFrame& message, std::int64_t sent_ns) {
  gaps_.count(message.sequence);
  auto frame = from_message(message);
  {
    const std::lock_guard lock(mutex_);
    counters_.lost_transport = gaps_.lost();
    ++(frame ? counters_.received : counters_.rejected);
  }
  if (!frame) {
    report(SourceState::kBadFrame, "frame " + std::to_string(message.sequence) + " on " +
                                       frames_.topic() + " refused: " + frame.error());
    return;
  }
  const bool history = frame->clock == MessageTraits<msg::StereoFrame>::CLOCK_DATASET;
  const std::int64_t origin = history ? sent_ns : frame->stamp_ns;
  push({{SourceState::kFrame, std::move(*frame), {}}, origin});
}

void StereoSubscriber::push(Item item) {
  const std::lock_guard lock(mutex_);
  const bool is_frame = item.result.state == SourceState::kFrame;
  const auto same_kind = [&](const Item& other) {
    return (other.result.state == SourceState::kFrame) == is_frame;
  };
  const auto waiting = std::count_if(queue_.begin(), queue_.end(), same_kind);
  const auto most = is_frame ? std::max(config_.queue, 1) : static_cast<int>(kMostReports);
  if (waiting >= most) {
    queue_.erase(std::find_if(queue_.begin(), queue_.end(), same_kind));
    if (is_frame) ++counters_.dropped_queue;
  }
  queue_.push_back(std::move(item));
  changed_.notify_all();
}

void StereoSubscriber::report(SourceState state, const std::string& message) {
  push({{state, {}, message}, 0});
}

std::uint64_t StereoSubscriber::publisher_of(const ReaderBase& reader,
                                             dds_instance_handle_t writer) {
  const auto known = publishers_.find(writer);
  if (known != publishers_.end()) return known->second;
  // A writer that has gone since stands for itself.
  const std::uint64_t publisher = participant_of(reader.entity(), writer).value_or(writer);
  if (publishers_.size() >= kMostPublishers) publishers_.clear();
  publishers_.emplace(writer, publisher);
  return publisher;
}

bool StereoSubscriber::is_alive(std::uint64_t publisher) const {
  return has_writer_of(frames_.entity(), publisher) ||
         has_writer_of(calibrations_.entity(), publisher);
}

}  // namespace sovo::bridge
