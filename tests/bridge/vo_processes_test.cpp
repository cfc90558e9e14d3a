#include <gtest/gtest.h>

#include <map>

#include "sovo/bridge/command_subscriber.h"
#include "sovo/bridge/reader.h"
#include "sovo/bridge/topics.h"
#include "sovo/bridge/vo_publisher.h"
#include "sovo/bridge/writer.h"
#include "test_bus.h"

namespace sovo::bridge {
namespace {

using namespace std::chrono_literals;

/// Counts what arrives on a topic.
template <class T>
struct Listener {
  Reader<T> reader;
  int messages = 0;

  Listener(const Participant& participant, const char* topic, const TopicQos& qos)
      : reader(require(Reader<T>::open(participant, topic, qos))) {}

  int count() {
    const auto taken = reader.take_each([](const T&, const dds_sample_info_t&) {});
    EXPECT_TRUE(taken.ok());
    messages += taken.ok() ? *taken : 0;
    return messages;
  }
};

TEST(VoPublisher, OnlyMetricPosesGoToOdomAndTf) {
  const Participant vo = open_participant();
  const Participant other = open_remote_participant();
  Listener<msg::Odometry> odom(other, topics::kOdometry, topics::kOdometryQos);
  Listener<msg::ScaledOdometry> scaled(other, topics::kScaledOdometry, topics::kScaledOdometryQos);
  Listener<msg::VoStatus> status(other, topics::kStatus, topics::kStatusQos);
  Listener<msg::TFMessage> tf(other, topics::kTf, topics::kTfQos);
  Listener<msg::Keyframe> keyframes(other, topics::kKeyframe, topics::kKeyframeQos);
  Listener<msg::Path> path(other, topics::kPath, topics::kPathQos);
  Listener<msg::DiagnosticArray> diagnostics(other, topics::kDiagnostics, topics::kDiagnosticsQos);
  auto publisher = require(VoPublisher::open(vo, {}, body_from_optical()));
  const auto matched = [&] {
    return odom.reader.num_writers() + scaled.reader.num_writers() + status.reader.num_writers() +
               tf.reader.num_writers() + diagnostics.reader.num_writers() ==
           5U;
  };
  ASSERT_TRUE(eventually(matched));
  // The writers' side of discovery may be later than the readers'.
  ASSERT_TRUE(eventually([&] {
    OdometryOutput lost;
    lost.state = OdometryState::kLost;
    publisher->on_frame(lost);
    return status.count() > 0;
  }));

  OdometryOutput output;
  output.state = OdometryState::kScaleUnobserved;
  output.pose_valid = true;
  publisher->on_frame(output);
  publisher->on_keyframe({});
  ASSERT_TRUE(eventually([&] { return scaled.count() == 1; }));
  output.scale_valid = true;
  output.state = OdometryState::kTracking;
  publisher->on_frame(output);
  KeyframeOutput metric;
  metric.scale_valid = true;
  publisher->on_keyframe(metric);
  ASSERT_TRUE(eventually([&] { return scaled.count() == 2; }));
  ASSERT_TRUE(eventually([&] { return odom.count() >= 1 && tf.count() >= 1; }));
  ASSERT_TRUE(eventually([&] { return keyframes.count() == 2 && path.count() == 1; }));
  EXPECT_EQ(odom.count(), 1);
  EXPECT_EQ(tf.count(), 1);
  EXPECT_EQ(publisher->failed_writes(), 0U) << publisher->last_failure();
}

TEST(VoPublisher, ARevisedKeyframeIsWrittenAgainWithItsId) {
  const Participant vo = open_participant();
  const Participant other = open_remote_participant();
  auto publisher = require(VoPublisher::open(vo, {}, SE3()));
  KeyframeOutput keyframe;
  keyframe.segment = 2;
  keyframe.scale_valid = true;
  for (const std::uint32_t id : {0U, 1U}) {
    keyframe.id = id;
    keyframe.T_odom_left.translation().x() = 1.0 + id;
    keyframe.inverse_depth = {0.5F, 0.25F};
    publisher->on_keyframe(keyframe);
  }
  keyframe.id = 0;
  keyframe.revised = true;
  keyframe.T_odom_left.translation().x() = 1.5;
  keyframe.inverse_depth = {0.4F};
  publisher->on_keyframe(keyframe);

  // Whoever comes late gets all of them, in their order, and keeps the last of each id.
  auto reader =
      require(Reader<msg::Keyframe>::open(other, topics::kKeyframe, topics::kKeyframeQos));
  std::vector<std::uint32_t> ids;
  std::map<std::uint32_t, std::pair<double, std::uint32_t>> kept;
  ASSERT_TRUE(eventually([&] {
    const auto taken = reader.take_each([&](const msg::Keyframe& m, const dds_sample_info_t&) {
      EXPECT_EQ(m.segment, 2U);
      ids.push_back(m.id);
      kept[m.id] = {m.pose.position.x, m.inverse_depth._length};
    });
    return taken.ok() && ids.size() >= 3;
  }));
  EXPECT_EQ(ids, (std::vector<std::uint32_t>{0, 1, 0}));
  EXPECT_EQ(kept[0], std::make_pair(1.5, 1U));
  EXPECT_EQ(kept[1], std::make_pair(2.0, 2U));
}

TEST(VoPublisher, TfIsLeftToOthersWhenToldSo) {
  const Participant vo = open_participant();
  VoPublisherConfig config;
  config.publish_tf = false;
  auto publisher = require(VoPublisher::open(vo, config, SE3()));
  const auto reader = require(Reader<msg::TFMessage>::open(vo, topics::kTf, topics::kTfQos));
  EXPECT_EQ(reader.num_writers(), 0U);
  OdometryOutput output;
  output.pose_valid = output.scale_valid = true;
  publisher->on_frame(output);
  EXPECT_EQ(publisher->failed_writes(), 0U);
}

/// Sends commands to a subscriber and gives those that it would obey.
struct Commander {
  Participant vo;
  Participant user;
  CommandSubscriber commands;
  Writer<msg::VoCommand> writer;

  Commander(Participant on, Participant from)
      : vo(std::move(on)),
        user(std::move(from)),
        commands(require(CommandSubscriber::open(vo))),
        writer(require(Writer<msg::VoCommand>::open(user, topics::kCommand, topics::kCommandQos))) {
    EXPECT_TRUE(eventually([&] { return writer.num_readers() > 0; }));
  }

  /// Sends messages and then a last one, and polls until that has come.
  std::vector<Command> send(std::vector<msg::VoCommand> messages) {
    for (const msg::VoCommand& message : messages) EXPECT_TRUE(writer.write(message).ok());
    msg::VoCommand last{};
    last.id = 999;
    last.command = 77;
    EXPECT_TRUE(writer.write(last).ok());
    std::vector<Command> result;
    EXPECT_TRUE(eventually([&] {
      for (const Command& command : commands.poll()) result.push_back(command);
      return commands.last_id() == 999;
    }));
    return result;
  }
};

msg::VoCommand command(std::uint64_t id, std::uint8_t kind) {
  msg::VoCommand m{};
  m.id = id;
  m.command = kind;
  return m;
}

TEST(CommandSubscriber, EachIdIsObeyedOnce) {
  Commander commander(open_participant(), open_remote_participant());
  msg::VoCommand with_pose = command(3, 1);
  with_pose.pose.position.x = 2.0;
  with_pose.pose.orientation.w = 1.0;
  const auto obeyed = commander.send({command(1, 1), command(1, 2), command(2, 3), with_pose});
  ASSERT_EQ(obeyed.size(), 3U);
  EXPECT_EQ(obeyed[0].kind, CommandKind::kReset);
  EXPECT_FALSE(obeyed[0].T_odom_base.has_value());
  EXPECT_EQ(obeyed[1].id, 2U);
  EXPECT_EQ(obeyed[1].kind, CommandKind::kResume);
  ASSERT_TRUE(obeyed[2].T_odom_base.has_value());
  EXPECT_EQ(obeyed[2].T_odom_base->translation().x(), 2.0);
  EXPECT_NE(commander.commands.last_result().find("77"), std::string::npos);
  commander.commands.answer(obeyed[1], "done");
  EXPECT_EQ(commander.commands.last_id(), 2U);
  EXPECT_EQ(commander.commands.last_result(), "done");
}

TEST(CommandSubscriber, ABrokenPoseIsRefused) {
  Commander commander(open_participant(), open_remote_participant());
  msg::VoCommand broken = command(3, 1);
  broken.pose.orientation.w = 5.0;
  EXPECT_TRUE(commander.send({broken}).empty());
}

TEST(CommandSubscriber, TheNetworkIsObeyedOnlyWhenAllowed) {
  DdsConfig open;
  open.accept_commands = true;
  EXPECT_EQ(
      Commander(open_remote_participant(open), open_participant()).send({command(1, 1)}).size(),
      1U);
  Commander closed(open_remote_participant(), open_participant());
  EXPECT_TRUE(closed.send({command(1, 1)}).empty());
  EXPECT_NE(closed.commands.last_result().find("accept_commands"), std::string::npos);
}

}  // namespace
}  // namespace sovo::bridge
