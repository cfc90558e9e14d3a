#include "sovo/bridge/dds_config.h"

#include <gtest/gtest.h>

#include "test_bus.h"

namespace sovo::bridge {
namespace {

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(NetworkPlan, DomainComesFromTheOptionThenTheEnvironment) {
  DdsConfig config;
  EXPECT_EQ(require(plan_network(config, {})).domain, 0U);
  DdsEnvironment environment;
  environment.ros_domain_id = "42";
  EXPECT_EQ(require(plan_network(config, environment)).domain, 42U);
  config.domain = 7;
  EXPECT_EQ(require(plan_network(config, environment)).domain, 7U);
}

TEST(NetworkPlan, WrongDomainsAreNamed) {
  for (const char* text : {"x", "12x", "-1", "233", "99999999999"}) {
    DdsEnvironment environment;
    environment.ros_domain_id = text;
    const auto plan = plan_network({}, environment);
    ASSERT_FALSE(plan.ok()) << text;
    EXPECT_TRUE(contains(plan.error(), "ROS_DOMAIN_ID")) << plan.error();
  }
  DdsConfig config;
  config.domain = 233;
  EXPECT_FALSE(plan_network(config, {}).ok());
}

TEST(NetworkPlan, LoopbackIsTheDefaultAndSaidSo) {
  const NetworkPlan plan = require(plan_network({}, {}));
  EXPECT_TRUE(plan.loopback_only);
  EXPECT_TRUE(contains(plan.xml, "name=\"lo\""));
  EXPECT_TRUE(contains(plan.xml, "<FragmentSize>65000B</FragmentSize>"));
  ASSERT_EQ(plan.notes.size(), 1U);
  EXPECT_TRUE(contains(plan.notes[0], "--network"));
}

TEST(NetworkPlan, InterfacesAndAddresses) {
  DdsConfig config;
  config.network = "eth0";
  EXPECT_TRUE(contains(require(plan_network(config, {})).xml, "name=\"eth0\""));
  EXPECT_FALSE(require(plan_network(config, {})).loopback_only);
  config.network = "192.168.1.5";
  EXPECT_TRUE(contains(require(plan_network(config, {})).xml, "address=\"192.168.1.5\""));
  config.network = "127.0.0.1";
  EXPECT_TRUE(require(plan_network(config, {})).loopback_only);
  for (const char* wrong : {"", "eth0\"/>", "a b", "<lo>"}) {
    config.network = wrong;
    EXPECT_FALSE(plan_network(config, {}).ok()) << wrong;
  }
}

TEST(NetworkPlan, CycloneDdsUriWinsAndAddsNoInterface) {
  DdsEnvironment environment;
  environment.cyclonedds_uri = "<CycloneDDS/>";
  environment.ros_localhost_only = "1";
  const NetworkPlan plan = require(plan_network({}, environment));
  EXPECT_FALSE(contains(plan.xml, "NetworkInterface"));
  EXPECT_TRUE(plan.xml.ends_with(",<CycloneDDS/>"));
  EXPECT_FALSE(plan.loopback_only);
}

TEST(NetworkPlan, RosVariablesKeepItLocal) {
  DdsConfig config;
  config.network = "eth0";
  DdsEnvironment environment;
  environment.ros_localhost_only = "1";
  EXPECT_TRUE(require(plan_network(config, environment)).loopback_only);
  environment = {};
  environment.ros_automatic_discovery_range = "LOCALHOST";
  EXPECT_TRUE(contains(require(plan_network(config, environment)).xml,
                       "<AllowMulticast>false</AllowMulticast>"));
  environment.ros_automatic_discovery_range = "SUBNET";
  EXPECT_TRUE(contains(require(plan_network(config, environment)).xml, "eth0"));
}

TEST(Participant, IsInTheDomainOfTheEnvironment) {
  DdsEnvironment environment;
  environment.ros_domain_id = std::to_string(test_domain());
  const Participant participant = require(Participant::open({}, "test", environment));
  dds_domainid_t domain = 0;
  ASSERT_EQ(dds_get_domainid(participant.entity(), &domain), DDS_RETCODE_OK);
  EXPECT_EQ(domain, static_cast<dds_domainid_t>(test_domain()));
}

TEST(Participant, AMissingInterfaceIsNamed) {
  DdsConfig config;
  config.domain = test_domain();
  config.network = "nosuch0";
  const auto participant = Participant::open(config, "test", {});
  ASSERT_FALSE(participant.ok());
  EXPECT_TRUE(contains(participant.error(), "nosuch0")) << participant.error();
}

TEST(Participant, OpensUnderEachDiscoveryRange) {
  for (const char* range : {"LOCALHOST", "OFF", "SUBNET", "SYSTEM_DEFAULT"}) {
    DdsConfig config;
    config.domain = test_domain();
    DdsEnvironment environment;
    environment.ros_automatic_discovery_range = range;
    const auto participant = Participant::open(config, "test", environment);
    EXPECT_TRUE(participant.ok()) << range << ": " << participant.error();
  }
}

TEST(Participant, TellsItsEnclave) {
  const Participant participant = open_participant();
  const QosPtr qos(dds_create_qos());
  ASSERT_EQ(dds_get_qos(participant.entity(), qos.get()), DDS_RETCODE_OK);
  void* data = nullptr;
  std::size_t size = 0;
  ASSERT_TRUE(dds_qget_userdata(qos.get(), &data, &size));
  EXPECT_EQ(std::string(static_cast<const char*>(data), size), "enclave=/;");
  dds_free(data);
}

}  // namespace
}  // namespace sovo::bridge
