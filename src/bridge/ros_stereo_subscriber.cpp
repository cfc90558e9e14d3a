#include "sovo/bridge/ros_stereo_subscriber.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "sovo/bridge/borrow.h"
#include "sovo/bridge/camera_info_conversion.h"
#include "sovo/bridge/image_topics.h"
#include "sovo/bridge/ros_conversion.h"
#include "sovo/bridge/stereo_frame_conversion.h"
#include "sovo/bridge/topics.h"

namespace sovo::bridge {
namespace {

using namespace std::chrono_literals;

constexpr auto kPairPoll = 2ms;  // of the other side and of calibrations
constexpr std::size_t kMostReasons = 64;
constexpr std::size_t kMostPairReports = 16;
constexpr std::int64_t kHistoryNs = 10'000'000'000;  // older stamps are those of a recording

}  // namespace

/// One camera's topics.
struct RosStereoSubscriber::Side {
  std::string topic;
  Reader<msg::Image> images;
  Reader<msg::CameraInfo> infos;
  std::optional<CameraInfoCopy> info;
  bool best_effort = false;
  dds_instance_handle_t followed = 0;
};

RosStereoSubscriber::RosStereoSubscriber(const Participant& participant,
                                         const RosStereoConfig& config)
    : participant_(participant),
      config_(config),
      pairing_(static_cast<std::int64_t>(1e9 * config.tolerance_s)) {}

Result<void> RosStereoSubscriber::open_side(bool is_left) {
  const std::string& topic = is_left ? config_.left : config_.right;
  if (is_compressed(topic)) {
    return Error{topic + " has compressed images; give the topic of the images themselves"};
  }
  auto images = Reader<msg::Image>::open(participant_, topic, topics::kImageQos);
  if (!images) return images.failure();
  auto infos = Reader<msg::CameraInfo>::open(participant_, info_topic(topic), {4, false, true});
  if (!infos) return infos.failure();
  const std::string name = images->topic();
  (is_left ? left_ : right_) = std::make_unique<Side>(
      Side{name, std::move(*images), std::move(*infos), std::nullopt, false, 0});
  return {};
}

Result<std::unique_ptr<RosStereoSubscriber>> RosStereoSubscriber::open(
    const Participant& participant, const RosStereoConfig& config,
    std::optional<StereoCameras> calibration) {
  std::unique_ptr<RosStereoSubscriber> source(new RosStereoSubscriber(participant, config));
  for (const bool is_left : {true, false}) {
    if (auto opened = source->open_side(is_left); !opened) return opened.failure();
  }
  source->calibration_given_ = calibration.has_value();
  source->cameras_ = std::move(calibration);
  source->missing_ = "no camera_info came yet";
  source->thread_ = std::thread([raw = source.get()] { raw->receive(); });
  return source;
}

RosStereoSubscriber::~RosStereoSubscriber() {
  stopping_ = true;
  if (left_) left_->images.wake();
  if (thread_.joinable()) thread_.join();
}

Result<void> RosStereoSubscriber::wait_for_calibration(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, timeout, [&] { return cameras_.has_value(); });
  if (cameras_) return {};
  return Error{missing_};
}

SourceResult RosStereoSubscriber::next(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, timeout, [&] { return !queue_.empty(); });
  if (queue_.empty()) return {};
  Item item = std::move(queue_.front());
  queue_.pop_front();
  if (item.latency_origin_ns != 0) latency_origin_ns_ = item.latency_origin_ns;
  return std::move(item.result);
}

FeedCounters RosStereoSubscriber::counters() const {
  const std::lock_guard lock(mutex_);
  return counters_;
}

void RosStereoSubscriber::receive() {
  while (!stopping_) {
    try {
      left_->images.wait(kPairPoll);
      work();
    } catch (const std::exception& e) {
      push({{SourceState::kFailed, {}, std::string("receiving images failed: ") + e.what()}, 0});
      return;
    }
  }
}

void RosStereoSubscriber::work() {
  for (const bool is_left : {true, false}) {
    fall_back_to_best_effort(side(is_left), is_left);
    take_images(is_left);
  }
  if (!calibration_given_) take_calibration();
  hand_out_pairs();
}

/// A reliable reader does not match a writer that offers best effort alone.
void RosStereoSubscriber::fall_back_to_best_effort(Side& s, bool is_left) {
  if (s.best_effort) return;
  dds_requested_incompatible_qos_status_t status{};
  if (dds_get_requested_incompatible_qos_status(s.images.entity(), &status) != DDS_RETCODE_OK ||
      status.total_count == 0 || status.last_policy_id != DDS_RELIABILITY_QOS_POLICY_ID) {
    return;
  }
  auto reader = Reader<msg::Image>::open(participant_, is_left ? config_.left : config_.right,
                                         {topics::kImageQos.depth, false, true});
  if (!reader) {
    report_once(reader.error());
    return;
  }
  s.images = std::move(*reader);
  s.best_effort = true;
  report_once(s.topic + " is offered without repetition (best effort): lost images stay lost");
}

void RosStereoSubscriber::take_images(bool is_left) {
  const auto taken =
      side(is_left).images.take_each([&](const msg::Image& image, const dds_sample_info_t& info) {
        take_image(is_left, image, info);
      });
  if (!taken) report_once(taken.error());
}

void RosStereoSubscriber::take_image(bool is_left, const msg::Image& image,
                                     const dds_sample_info_t& info) {
  Side& s = side(is_left);
  const dds_instance_handle_t writer = info.publication_handle;
  if (s.followed != writer && s.followed != 0 && s.images.has_writer(s.followed)) {
    report_once("a second publisher writes to " + s.topic + ": its images are ignored");
    const std::lock_guard lock(mutex_);
    ++counters_.foreign;
    return;
  }
  if (s.followed != writer) {
    s.followed = writer;
    if (is_left) {
      session_ = writer;
      sequence_ = 0;
      pairing_.clear();
    }
  }
  auto converted = from_message(image, is_left ? "left" : "right");
  if (!converted) {
    report_once(s.topic + ": " + converted.error());
    const std::lock_guard lock(mutex_);
    ++counters_.rejected;
    return;
  }
  StereoPairing::Image stamped{stamp_ns(image.header.stamp), std::move(*converted),
                               short_text(image.header.frame_id)};
  newest_sent_ns_ = info.source_timestamp;
  is_left ? pairing_.add_left(std::move(stamped)) : pairing_.add_right(std::move(stamped));
}

void RosStereoSubscriber::take_calibration() {
  {
    const std::lock_guard lock(mutex_);
    if (cameras_) return;
  }
  std::string missing;
  for (const bool is_left : {true, false}) {
    Side& s = side(is_left);
    (void)s.infos.take_each(
        [&s](const msg::CameraInfo& info, const dds_sample_info_t&) { s.info = copy(info); });
    if (s.info) continue;
    missing += (missing.empty() ? "no calibration on " : " and ") + s.infos.topic();
    if (s.images.num_writers() == 0) missing += ", and no images on " + s.topic;
  }
  std::optional<StereoCameras> cameras;
  if (missing.empty()) {
    auto made = cameras_from(*left_->info, *right_->info,
                             ImageTopics{left_->topic, right_->topic}.rectified());
    if (made) {
      cameras = std::move(*made);
    } else {
      missing = "camera_info cannot be used: " + made.error() + "; --calib gives a file instead";
    }
  } else {
    missing += ": is the driver running, in the same domain and network? --calib gives a file";
  }
  const std::lock_guard lock(mutex_);
  missing_ = missing;
  if (!cameras) return;
  cameras_ = std::move(cameras);
  changed_.notify_all();
}

void RosStereoSubscriber::hand_out_pairs() {
  while (auto frame = pairing_.next()) {
    frame->session = session_;
    frame->sequence = sequence_++;
    const bool history = newest_sent_ns_ - frame->stamp_ns > kHistoryNs;
    const std::int64_t origin = history ? newest_sent_ns_ : frame->stamp_ns;
    {
      const std::lock_guard lock(mutex_);
      ++counters_.received;
    }
    push({{SourceState::kFrame, std::move(*frame), {}}, origin});
  }
  const std::lock_guard lock(mutex_);
  counters_.lost_transport = pairing_.unpaired();
}

void RosStereoSubscriber::push(Item item) {
  const std::lock_guard lock(mutex_);
  const bool is_frame = item.result.state == SourceState::kFrame;
  const auto same_kind = [&](const Item& other) {
    return (other.result.state == SourceState::kFrame) == is_frame;
  };
  const auto waiting = std::count_if(queue_.begin(), queue_.end(), same_kind);
  const auto most = is_frame ? std::max(config_.queue, 1) : static_cast<int>(kMostPairReports);
  if (waiting >= most) {
    queue_.erase(std::find_if(queue_.begin(), queue_.end(), same_kind));
    if (is_frame) ++counters_.dropped_queue;
  }
  queue_.push_back(std::move(item));
  changed_.notify_all();
}

void RosStereoSubscriber::report_once(const std::string& text) {
  if (reported_.size() >= kMostReasons) reported_.clear();
  if (!reported_.emplace(text, true).second) return;
  push({{SourceState::kBadFrame, {}, text}, 0});
}

}  // namespace sovo::bridge
