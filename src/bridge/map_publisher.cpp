#include "sovo/bridge/map_publisher.h"

#include <optional>
#include <utility>

#include "sovo/bridge/borrow.h"
#include "sovo/bridge/ros_conversion.h"
#include "sovo/bridge/topics.h"

namespace sovo::bridge {

struct MapPublisher::Writers {
  Writer<msg::Path> path;
  std::optional<Writer<msg::TFMessage>> tf;
};

MapPublisher::MapPublisher() = default;
MapPublisher::~MapPublisher() = default;

Result<std::unique_ptr<MapPublisher>> MapPublisher::open(const Participant& participant,
                                                         bool publish_tf, const SE3& T_base_left) {
  auto path = Writer<msg::Path>::open(participant, topics::kMapPath, topics::kMapPathQos);
  if (!path) return path.failure();
  std::unique_ptr<MapPublisher> publisher(new MapPublisher());
  publisher->writers_ = std::make_unique<Writers>(Writers{std::move(*path), std::nullopt});
  if (publish_tf) {
    auto tf = Writer<msg::TFMessage>::open(participant, topics::kTf, topics::kTfQos);
    if (!tf) return tf.failure();
    publisher->writers_->tf.emplace(std::move(*tf));
  }
  publisher->T_base_left_ = T_base_left;
  publisher->map_frame_ = participant.frame("map");
  publisher->odom_frame_ = participant.frame("odom");
  return publisher;
}

std::string MapPublisher::last_failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

void MapPublisher::check(const Result<void>& written) {
  if (written) return;
  ++failed_writes_;
  const std::lock_guard lock(mutex_);
  failure_ = written.error();
}

void MapPublisher::set_map(const SE3& T_map_odom, const std::vector<TrajectoryPose>& places,
                           bool closed) {
  {
    const std::lock_guard lock(mutex_);
    T_map_odom_ = T_map_odom;
    const bool due = path_pace_.due();
    if (places.empty() || !(due || closed)) return;
  }
  const SE3 T_left_base = T_base_left_.inverse();
  std::vector<msg::PoseStamped> poses;
  poses.reserve(places.size());
  for (const TrajectoryPose& place : places) {
    poses.push_back({{to_message(place.stamp_ns), borrow(map_frame_)},
                     to_pose(T_base_left_ * place.T_odom_left * T_left_base)});
  }
  msg::Path message{};
  message.header = poses.back().header;
  borrow(message.poses, poses);
  check(writers_->path.write(message));
}

void MapPublisher::on_frame(const OdometryOutput& output) {
  if (!writers_->tf || !output.pose_valid || !output.scale_valid) return;
  SE3 T_map_odom;
  {
    const std::lock_guard lock(mutex_);
    T_map_odom = T_map_odom_;
  }
  const std::vector<msg::TransformStamped> transforms = {
      {{to_message(output.stamp_ns), borrow(map_frame_)},
       borrow(odom_frame_),
       to_transform(T_base_left_ * T_map_odom * T_base_left_.inverse())}};
  msg::TFMessage message{};
  borrow(message.transforms, transforms);
  check(writers_->tf->write(message));
}

}  // namespace sovo::bridge
