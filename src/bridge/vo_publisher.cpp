#include "sovo/bridge/vo_publisher.h"

#include <optional>
#include <utility>
#include <vector>

#include "sovo/bridge/borrow.h"
#include "sovo/bridge/ros_conversion.h"
#include "sovo/bridge/topics.h"

namespace sovo::bridge {
namespace {

constexpr std::size_t kLongestPath = 10'000;

template <class T>
Result<void> open_into(std::optional<Writer<T>>* writer, const Participant& participant,
                       const char* name, const TopicQos& qos) {
  auto opened = Writer<T>::open(participant, name, qos);
  if (!opened) return opened.failure();
  writer->emplace(std::move(*opened));
  return {};
}

}  // namespace

struct VoPublisher::Writers {
  std::optional<Writer<msg::Odometry>> odom;
  std::optional<Writer<msg::ScaledOdometry>> scaled;
  std::optional<Writer<msg::VoStatus>> status;
  std::optional<Writer<msg::Keyframe>> keyframe;
  std::optional<Writer<msg::Path>> path;
  std::optional<Writer<msg::TFMessage>> tf;  ///< Only with publish_tf.
};

Result<std::unique_ptr<VoPublisher>> VoPublisher::open(const Participant& participant,
                                                       const VoPublisherConfig& config,
                                                       const SE3& T_base_left) {
  std::unique_ptr<VoPublisher> publisher(new VoPublisher());
  auto writers = std::make_unique<Writers>();
  std::vector<Result<void>> opened = {
      open_into(&writers->odom, participant, topics::kOdometry, topics::kOdometryQos),
      open_into(&writers->scaled, participant, topics::kScaledOdometry, topics::kScaledOdometryQos),
      open_into(&writers->status, participant, topics::kStatus, topics::kStatusQos),
      open_into(&writers->keyframe, participant, topics::kKeyframe, topics::kKeyframeQos),
      open_into(&writers->path, participant, topics::kPath, topics::kPathQos),
  };
  if (config.publish_tf) {
    opened.push_back(open_into(&writers->tf, participant, topics::kTf, topics::kTfQos));
  }
  for (const auto& one : opened) {
    if (!one) return one.failure();
  }
  publisher->config_ = config;
  publisher->T_base_left_ = T_base_left;
  publisher->frames_ = {participant.frame("odom"), participant.frame("base_link")};
  publisher->writers_ = std::move(writers);
  auto views = VoViews::open(participant, publisher->frames_, T_base_left, config.publish_odom);
  if (!views) return views.failure();
  publisher->views_ = std::move(*views);
  return publisher;
}

VoPublisher::VoPublisher() = default;
VoPublisher::~VoPublisher() = default;

void VoPublisher::set_feed(const FeedStatus& feed) {
  const std::lock_guard lock(mutex_);
  feed_ = feed;
}

std::string VoPublisher::last_failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

void VoPublisher::check(const Result<void>& written) {
  if (written) return;
  ++failed_writes_;
  const std::lock_guard lock(mutex_);
  failure_ = written.error();
}

void VoPublisher::on_frame(const OdometryOutput& output) {
  if (output.pose_valid) publish_pose(output);
  FeedStatus feed;
  {
    const std::lock_guard lock(mutex_);
    feed = feed_;
  }
  const StatusMessage status(output, feed, timings_.times(), frames_, dds_time());
  check(writers_->status->write(status.message()));
  views_->offer(output, feed);
}

void VoPublisher::publish_pose(const OdometryOutput& output) {
  const BaseMotion motion = to_base(output, T_base_left_);
  check(writers_->scaled->write(to_scaled_odometry(output, motion, frames_)));
  if (!output.scale_valid || !config_.publish_odom) return;
  check(writers_->odom->write(to_odometry(output, motion, frames_)));
  if (writers_->tf) publish_transform(output, motion);
}

void VoPublisher::publish_transform(const OdometryOutput& output, const BaseMotion& motion) {
  const std::vector<msg::TransformStamped> transforms = {
      {{to_message(output.stamp_ns), borrow(frames_.odom)},
       borrow(frames_.base_link),
       to_transform(motion.T_odom_base)}};
  msg::TFMessage message{};
  borrow(message.transforms, transforms);
  check(writers_->tf->write(message));
}

void VoPublisher::on_keyframe(const KeyframeOutput& keyframe) {
  check(writers_->keyframe->write(to_message(keyframe, T_base_left_, frames_)));
  views_->offer(keyframe);
  if (keyframe.id == 0 && !keyframe.revised) path_.clear();  // another map begins
  if (keyframe.scale_valid && config_.publish_odom) publish_path(keyframe);
}

void VoPublisher::publish_path(const KeyframeOutput& keyframe) {
  path_.insert_or_assign(keyframe.id, to_path_pose(keyframe, T_base_left_, frames_));
  if (path_.size() > kLongestPath) path_.erase(path_.begin());
  if (!path_pace_.due()) return;
  std::vector<msg::PoseStamped> poses;
  poses.reserve(path_.size());
  for (const auto& [id, pose] : path_) poses.push_back(pose);
  msg::Path message{};
  message.header = poses.back().header;
  borrow(message.poses, poses);
  check(writers_->path->write(message));
}

}  // namespace sovo::bridge
