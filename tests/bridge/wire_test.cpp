#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <memory>

#include "sovo/bridge/camera_publisher.h"
#include "sovo/bridge/ros_graph.h"
#include "sovo/bridge/ros_names.h"
#include "sovo/bridge/topics.h"
#include "sovo/bridge/vo_publisher.h"
#include "test_bus.h"
#include "test_cameras.h"

namespace sovo::bridge {
namespace {

/// What discovery tells others about a writer.
struct Discovered {
  std::string type;
  std::string user_data;
  bool reliable = false;
  bool latched = false;
  bool autodispose = true;
  dds_duration_t max_blocking_time = 0;
  std::int32_t depth = 0;
  std::int32_t service_depth = 0;
};

std::string user_data_of(const dds_qos_t* qos) {
  void* data = nullptr;
  std::size_t size = 0;
  if (!dds_qget_userdata(qos, &data, &size) || data == nullptr) return {};
  const std::string text(static_cast<const char*>(data), size);
  dds_free(data);
  return text;
}

Discovered describe(const dds_builtintopic_endpoint_t& endpoint) {
  Discovered d;
  d.type = endpoint.type_name;
  d.user_data = user_data_of(endpoint.qos);
  dds_reliability_kind_t reliability{};
  dds_qget_reliability(endpoint.qos, &reliability, &d.max_blocking_time);
  d.reliable = reliability == DDS_RELIABILITY_RELIABLE;
  dds_durability_kind_t durability{};
  dds_qget_durability(endpoint.qos, &durability);
  d.latched = durability == DDS_DURABILITY_TRANSIENT_LOCAL;
  dds_history_kind_t history{};
  dds_qget_history(endpoint.qos, &history, &d.depth);
  EXPECT_EQ(history, DDS_HISTORY_KEEP_LAST);
  if (d.latched) {
    dds_history_kind_t kind{};
    dds_qget_durability_service(endpoint.qos, nullptr, &kind, &d.service_depth, nullptr, nullptr,
                                nullptr);
  }
  return d;
}

/// Writers that a participant has discovered, by topic name on the wire.
class Discovery {
 public:
  explicit Discovery(const Participant& participant)
      : reader_(dds_create_reader(participant.entity(), DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr,
                                  nullptr)) {}

  bool has(const std::string& topic) {
    take();
    return writers_.contains(topic);
  }
  const Discovered& writer(const std::string& topic) { return writers_.at(topic); }

 private:
  void take() {
    void* sample = nullptr;
    dds_sample_info_t info{};
    while (dds_take(reader_.get(), &sample, &info, 1, 1) == 1) {
      if (info.valid_data) {
        const auto* endpoint = static_cast<const dds_builtintopic_endpoint_t*>(sample);
        writers_.insert_or_assign(endpoint->topic_name, describe(*endpoint));
      }
      dds_return_loan(reader_.get(), &sample, 1);
      sample = nullptr;
    }
  }

  DdsHandle reader_;
  std::map<std::string, Discovered> writers_;
};

struct Expected {
  const char* topic;
  const char* type;
  bool latched;
  int depth;
};

void expect_writer(Discovery& discovery, const Expected& expected, const std::string& hash) {
  SCOPED_TRACE(expected.topic);
  ASSERT_TRUE(eventually([&] { return discovery.has(expected.topic); }));
  const Discovered& found = discovery.writer(expected.topic);
  EXPECT_EQ(found.type, expected.type);
  EXPECT_TRUE(found.reliable);
  EXPECT_EQ(found.max_blocking_time, DDS_MSECS(33));
  EXPECT_EQ(found.latched, expected.latched);
  EXPECT_EQ(found.user_data, "typehash=" + hash + ";");
  if (expected.latched) {
    EXPECT_EQ(found.service_depth, expected.depth);
  }
}

TEST(Wire, CameraTopicsLookAsRosExpects) {
  const Participant camera = open_participant();
  const Participant other = open_remote_participant();
  const auto publisher = require(CameraPublisher::open(camera, test_cameras(), 0));
  Discovery discovery(other);
  expect_writer(discovery, {"rt/sovo/stereo", "sovo_msgs::msg::dds_::StereoFrame_", false, 4},
                type_hash::kSovoMsgsStereoFrame);
  expect_writer(discovery,
                {"rt/sovo/calibration", "sovo_msgs::msg::dds_::StereoCalibration_", true, 1},
                type_hash::kSovoMsgsStereoCalibration);
  expect_writer(discovery, {"rt/tf_static", "tf2_msgs::msg::dds_::TFMessage_", true, 1},
                "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087");
}

TEST(Wire, OdometryTopicsLookAsRosExpects) {
  const Participant vo = open_participant();
  const Participant other = open_remote_participant();
  const auto publisher = require(VoPublisher::open(vo, {}, SE3()));
  Discovery discovery(other);
  expect_writer(discovery, {"rt/sovo/odom", "nav_msgs::msg::dds_::Odometry_", false, 10},
                "RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0");
  expect_writer(discovery,
                {"rt/sovo/scaled_odometry", "sovo_msgs::msg::dds_::ScaledOdometry_", false, 10},
                type_hash::kSovoMsgsScaledOdometry);
  expect_writer(discovery, {"rt/sovo/status", "sovo_msgs::msg::dds_::VoStatus_", false, 10},
                type_hash::kSovoMsgsVoStatus);
  expect_writer(discovery, {"rt/sovo/keyframe", "sovo_msgs::msg::dds_::Keyframe_", true, 200},
                type_hash::kSovoMsgsKeyframe);
  expect_writer(discovery, {"rt/sovo/path", "nav_msgs::msg::dds_::Path_", true, 1},
                "RIHS01_1957a5bb3cee5da65c4e52e52b65a93df227efce4c20f8458b36e73066ca334b");
  expect_writer(discovery, {"rt/tf", "tf2_msgs::msg::dds_::TFMessage_", false, 100},
                type_hash::kTf2MsgsTFMessage);
  expect_writer(discovery,
                {"rt/diagnostics", "diagnostic_msgs::msg::dds_::DiagnosticArray_", false, 10},
                type_hash::kDiagnosticMsgsDiagnosticArray);
}

TEST(Wire, WritersKeepTheirHistoryAndDoNotDispose) {
  const Participant participant = open_participant();
  const auto writer = require(Writer<msg::Keyframe>::open(participant, "keyframe", latched(200)));
  const QosPtr qos(dds_create_qos());
  ASSERT_EQ(dds_get_qos(writer.entity(), qos.get()), DDS_RETCODE_OK);
  dds_history_kind_t kind{};
  std::int32_t depth = 0;
  ASSERT_TRUE(dds_qget_history(qos.get(), &kind, &depth));
  EXPECT_EQ(kind, DDS_HISTORY_KEEP_LAST);
  EXPECT_EQ(depth, 200);
  bool autodispose = true;
  ASSERT_TRUE(dds_qget_writer_data_lifecycle(qos.get(), &autodispose));
  EXPECT_FALSE(autodispose);
  std::uint32_t count = 0;
  dds_data_representation_id_t* representations = nullptr;
  ASSERT_TRUE(dds_qget_data_representation(qos.get(), &count, &representations));
  ASSERT_EQ(count, 1U);
  EXPECT_EQ(representations[0], DDS_DATA_REPRESENTATION_XCDR1);
  dds_free(representations);
}

TEST(Wire, NamesFollowTheNamespace) {
  EXPECT_EQ(dds_topic(ros_topic("sovo", "stereo")), "rt/sovo/stereo");
  EXPECT_EQ(dds_topic(ros_topic("auv1", "odom")), "rt/auv1/odom");
  EXPECT_EQ(dds_topic(ros_topic("/fleet/auv1", "odom")), "rt/fleet/auv1/odom");
  EXPECT_EQ(dds_topic(ros_topic("auv1", "/tf")), "rt/tf");
  EXPECT_EQ(dds_topic(ros_topic("", "odom")), "rt/odom");
  EXPECT_EQ(frame_name("sovo", "odom"), "odom");
  EXPECT_EQ(frame_name("auv1", "odom"), "auv1/odom");
}

/// The graph message that `ros2 node list` reads, in both of its layouts.
template <class Info>
void expect_graph(RosGraph layout, std::size_t gid_size) {
  DdsConfig config;
  config.ros.graph = layout;
  const Participant participant = open_participant(config);
  const auto writer = require(Writer<msg::VoStatus>::open(participant, "status", reliable(10)));
  Discovery discovery(participant);
  ASSERT_TRUE(eventually([&] { return discovery.has("ros_discovery_info"); }));
  EXPECT_EQ(discovery.writer("ros_discovery_info").type,
            "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_");
  EXPECT_TRUE(discovery.writer("ros_discovery_info").latched);

  const Participant other = open_remote_participant();
  const dds_topic_descriptor_t descriptor = graph_descriptor(layout);
  DdsHandle topic(
      dds_create_topic(other.entity(), &descriptor, "ros_discovery_info", nullptr, nullptr));
  const QosPtr qos = reader_qos(latched(1), "");
  DdsHandle reader(dds_create_reader(other.entity(), topic.get(), qos.get(), nullptr));
  ASSERT_GT(reader.get(), 0);
  void* sample = nullptr;
  dds_sample_info_t sample_info{};
  ASSERT_TRUE(eventually([&] { return dds_take(reader.get(), &sample, &sample_info, 1, 1) == 1; }));
  const auto& info = *static_cast<const Info*>(sample);
  EXPECT_EQ(sizeof(info.gid.data), gid_size);
  dds_guid_t guid{};
  dds_get_guid(participant.entity(), &guid);
  EXPECT_EQ(std::memcmp(info.gid.data, guid.v, sizeof(guid.v)), 0);
  ASSERT_EQ(info.node_entities_info_seq._length, 1U);
  const auto& node = info.node_entities_info_seq._buffer[0];
  EXPECT_STREQ(node.node_name, "test");
  EXPECT_STREQ(node.node_namespace, "/sovo");
  ASSERT_EQ(node.writer_gid_seq._length, 1U);
  dds_get_guid(writer.entity(), &guid);
  EXPECT_EQ(std::memcmp(node.writer_gid_seq._buffer[0].data, guid.v, sizeof(guid.v)), 0);
  dds_return_loan(reader.get(), &sample, 1);
}

TEST(Wire, GraphOfHumble) {
  expect_graph<msg::ParticipantEntitiesInfoHumble>(RosGraph::kHumble, 24);
}

TEST(Wire, GraphOfIronAndLater) {
  expect_graph<msg::ParticipantEntitiesInfo>(RosGraph::kIronPlus, 16);
}

}  // namespace
}  // namespace sovo::bridge
