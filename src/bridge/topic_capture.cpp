#include "sovo/bridge/topic_capture.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <exception>

#include "sovo/bridge/recording_topics.h"
#include "sovo/bridge/topic_catalog.h"
#include "sovo/bridge/topics.h"

namespace sovo::bridge {
namespace {

using namespace std::chrono_literals;

constexpr auto kDiscoveryPeriod = 100ms;
// What a reader holds while this thread does not run: a second of images at 60 Hz.
constexpr int kLeastDepth = 64;

TopicQos reader_side(TopicQos qos) {
  qos.depth = std::max(qos.depth, kLeastDepth);
  return qos;
}

}  // namespace

Result<std::unique_ptr<TopicCapture>> TopicCapture::open(
    const Participant& participant, const std::vector<std::string>& more_topics, Sink sink) {
  auto discovery = TopicDiscovery::open(participant);
  if (!discovery) return discovery.failure();
  std::unique_ptr<TopicCapture> capture(
      new TopicCapture(participant, std::move(*discovery), std::move(sink)));
  if (auto opened = capture->open_waitset(); !opened) return opened.failure();
  for (const std::string& name : more_topics) {
    if (name == "all") capture->all_ = true;
    if (name.starts_with('-')) {
      capture->unwanted_.insert(participant.topic(name.substr(1)));
    } else {
      capture->wanted_.insert(participant.topic(name));
    }
  }
  for (const CatalogTopic& topic : topic_catalog()) {
    const std::string name = participant.topic(topic.name);
    if (capture->unwanted_.contains(name)) continue;
    if (topic.on_demand && !capture->wanted_.contains(name)) continue;
    capture->wanted_.insert(name);
    if (auto added = capture->add(name, *topic.schema, topic.qos); !added) return added.failure();
  }
  capture->thread_ = std::thread([raw = capture.get()] { raw->run(); });
  return capture;
}

TopicCapture::~TopicCapture() {
  stopping_ = true;
  if (guard_.get() > 0) dds_set_guardcondition(guard_.get(), true);
  if (thread_.joinable()) thread_.join();
}

std::vector<std::string> TopicCapture::unknown() const {
  const std::lock_guard lock(mutex_);
  return {unknown_.begin(), unknown_.end()};
}

std::string TopicCapture::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

Result<void> TopicCapture::open_waitset() {
  const std::string what = "cannot wait for messages";
  auto guard = take_entity(dds_create_guardcondition(participant_.entity()), what);
  if (!guard) return guard.failure();
  auto waitset = take_entity(dds_create_waitset(participant_.entity()), what);
  if (!waitset) return waitset.failure();
  guard_ = std::move(*guard);
  waitset_ = std::move(*waitset);
  const auto code = dds_waitset_attach(waitset_.get(), guard_.get(), 0);
  return code == DDS_RETCODE_OK ? Result<void>() : dds_error(what, code);
}

/// Opens the reader of a topic, or opens it anew for writers that offer less.
Result<void> TopicCapture::add(const std::string& ros_name, const MessageSchema& schema,
                               const TopicQos& qos) {
  Source& source = sources_[ros_name];
  if (source.condition.get() > 0) dds_waitset_detach(waitset_.get(), source.condition.get());
  source.condition.reset();
  source.reader.reset();
  const RecordingTopic about = recording_topic(ros_name, schema, qos);
  source.topic = std::make_shared<const CapturedTopic>(CapturedTopic{about, &schema, qos});
  auto reader = RawReader::open(participant_, ros_name, schema, reader_side(qos));
  if (!reader) return reader.failure();
  source.reader = std::make_unique<RawReader>(std::move(*reader));
  auto condition = take_entity(dds_create_readcondition(source.reader->entity(), DDS_ANY_STATE),
                               "cannot wait on " + ros_name);
  if (!condition) return condition.failure();
  source.condition = std::move(*condition);
  const auto code = dds_waitset_attach(waitset_.get(), source.condition.get(), 0);
  return code == DDS_RETCODE_OK ? Result<void>() : dds_error("cannot wait on " + ros_name, code);
}

bool TopicCapture::is_wanted(const std::string& ros_name) const {
  if (unwanted_.contains(ros_name)) return false;
  if (wanted_.contains(ros_name)) return true;
  return all_ && ros_name.starts_with('/');
}

Result<void> TopicCapture::follow_discovery() {
  const auto topics = discovery_.topics();
  if (!topics) return topics.failure();
  for (const DiscoveredTopic& topic : *topics) {
    if (topic.writers == 0 || !is_wanted(topic.name)) continue;
    const MessageSchema* schema = find_schema(topic.dds_type);
    if (schema == nullptr) {
      const std::lock_guard lock(mutex_);
      unknown_.insert(topic.name + " (" + topic.type + ")");
      continue;
    }
    const auto known = sources_.find(topic.name);
    if (known != sources_.end()) {
      const TopicQos& have = known->second.topic->qos;
      const bool hears =
          (have.best_effort || !topic.qos.best_effort) && (!have.latched || topic.qos.latched);
      if (known->second.topic->schema != schema || hears) continue;
    }
    if (auto added = add(topic.name, *schema, topic.qos); !added) return added;
  }
  return {};
}

Result<void> TopicCapture::take_all() {
  for (auto& [name, source] : sources_) {
    const auto taken = source.reader->take_each([&](CdrSample sample, const dds_sample_info_t&) {
      sink_(source.topic, std::move(sample), dds_time());
    });
    if (!taken) return taken.failure();
  }
  return {};
}

void TopicCapture::run() {
  const auto work = [this]() -> Result<void> {
    auto next_look = std::chrono::steady_clock::now();
    while (!stopping_) {
      const auto now = std::chrono::steady_clock::now();
      if (now >= next_look) {
        next_look = now + kDiscoveryPeriod;
        if (auto done = follow_discovery(); !done) return done;
      }
      dds_waitset_wait(waitset_.get(), nullptr, 0,
                       std::chrono::nanoseconds(kDiscoveryPeriod).count());
      if (auto done = take_all(); !done) return done;
    }
    return {};
  };
  std::string failure;
  try {
    if (auto done = work(); !done) failure = done.error();
  } catch (const std::exception& e) {
    failure = std::string("capturing messages failed: ") + e.what();
  }
  const std::lock_guard lock(mutex_);
  failure_ = failure;
}

}  // namespace sovo::bridge
