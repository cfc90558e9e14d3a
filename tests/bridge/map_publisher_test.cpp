#include "sovo/bridge/map_publisher.h"

#include <gtest/gtest.h>

#include <string>

#include "sovo/bridge/reader.h"
#include "sovo/bridge/topics.h"
#include "test_bus.h"

namespace sovo::bridge {
namespace {

/// What arrived last on `/tf` and `map_path`, and how often.
struct MapListener {
  Reader<msg::TFMessage> tf;
  Reader<msg::Path> path;
  int transforms = 0, paths = 0;
  std::string parent, child;
  Vec3 translation = Vec3::Zero();
  std::string path_frame;
  std::vector<Vec3> places;

  explicit MapListener(const Participant& participant)
      : tf(require(Reader<msg::TFMessage>::open(participant, topics::kTf, topics::kTfQos))),
        path(require(Reader<msg::Path>::open(participant, topics::kMapPath, topics::kMapPathQos))) {
  }

  void listen() {
    (void)tf.take_each([this](const msg::TFMessage& m, const dds_sample_info_t&) {
      ++transforms;
      const msg::TransformStamped& t = m.transforms._buffer[0];
      parent = t.header.frame_id;
      child = t.child_frame_id;
      const auto& p = t.transform.translation;
      translation = {p.x, p.y, p.z};
    });
    (void)path.take_each([this](const msg::Path& m, const dds_sample_info_t&) {
      ++paths;
      path_frame = m.header.frame_id;
      places.clear();
      for (std::uint32_t i = 0; i < m.poses._length; ++i) {
        const auto& p = m.poses._buffer[i].pose.position;
        places.emplace_back(p.x, p.y, p.z);
      }
    });
  }
  bool hears(const bool& with_tf) const {
    return path.num_writers() == 1 && tf.num_writers() == (with_tf ? 1U : 0U);
  }
};

OdometryOutput metric_output(std::int64_t stamp_ns) {
  OdometryOutput output;
  output.stamp_ns = stamp_ns;
  output.pose_valid = true;
  output.scale_valid = true;
  return output;
}

TEST(MapPublisher, SaysWhereOdomLiesWithEveryMetricPose) {
  const Participant vo = open_participant();
  const Participant other = open_remote_participant();
  MapListener listener(other);
  auto publisher = require(MapPublisher::open(vo, true, body_from_optical()));
  ASSERT_TRUE(eventually([&] { return listener.hears(true); }));
  // The writers' side of discovery may be later than the readers'.
  std::int64_t stamp = 0;
  ASSERT_TRUE(eventually([&] {
    publisher->on_frame(metric_output(++stamp));
    listener.listen();
    return listener.transforms > 0;
  }));
  EXPECT_TRUE(listener.parent.ends_with("map")) << listener.parent;
  EXPECT_TRUE(listener.child.ends_with("odom")) << listener.child;
  EXPECT_EQ(listener.translation, Vec3::Zero());

  // Some of those may have been written before the writer knew of its reader.
  publisher->set_map(SE3(SO3(), Vec3(0.0, 0.0, 0.25)), {}, true);
  publisher->on_frame(metric_output(++stamp));
  ASSERT_TRUE(eventually([&] {
    listener.listen();
    return listener.translation.x() > 0.2;
  }));
  const auto heard = listener.transforms;
  OdometryOutput without = metric_output(++stamp);
  without.scale_valid = false;
  publisher->on_frame(without);
  without = metric_output(stamp);
  without.pose_valid = false;
  publisher->on_frame(without);

  // One metre ahead of the left camera is one along the vehicle's x.
  publisher->set_map(SE3(SO3(), Vec3(0.0, 0.0, 1.0)), {}, true);
  publisher->on_frame(metric_output(++stamp));
  ASSERT_TRUE(eventually([&] {
    listener.listen();
    return listener.translation.x() > 0.5;
  }));
  EXPECT_LT((listener.translation - Vec3(1.0, 0.0, 0.0)).norm(), 1e-12);
  EXPECT_EQ(listener.transforms, heard + 1);
  EXPECT_EQ(listener.paths, 0);
  EXPECT_EQ(publisher->failed_writes(), 0U);
}

TEST(MapPublisher, PlacesAreShownAtOnceWhenALoopIsClosedElseOnceASecond) {
  const Participant vo = open_participant();
  const Participant other = open_remote_participant();
  auto publisher = require(MapPublisher::open(vo, false, body_from_optical()));
  const std::vector<TrajectoryPose> places = {{1, SE3()}, {2, SE3(SO3(), Vec3(1.0, 2.0, 3.0))}};
  publisher->set_map(SE3(), places, false);
  MapListener listener(other);  // who comes late gets what was last
  ASSERT_TRUE(eventually([&] {
    listener.listen();
    return listener.paths == 1;
  }));
  EXPECT_TRUE(listener.hears(false));
  EXPECT_TRUE(listener.path_frame.ends_with("map"));
  ASSERT_EQ(listener.places.size(), 2U);
  EXPECT_LT((listener.places[1] - Vec3(3.0, -1.0, -2.0)).norm(), 1e-12);

  publisher->set_map(SE3(), {places.front()}, false);  // too soon
  publisher->set_map(SE3(), places, true);
  ASSERT_TRUE(eventually([&] {
    listener.listen();
    return listener.paths == 2;
  }));
  EXPECT_EQ(listener.places.size(), 2U);
  publisher->on_frame(metric_output(1));  // publishes no transform
}

}  // namespace
}  // namespace sovo::bridge
