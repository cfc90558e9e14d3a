#include "sovo/bridge/dashboard/foxglove_protocol.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

namespace sovo::bridge::foxglove {
namespace {

using nlohmann::json;

TEST(FoxgloveProtocol, ChoosesASubprotocol) {
  EXPECT_EQ(choose_subprotocol("foxglove.sdk.v1"), "foxglove.sdk.v1");
  EXPECT_EQ(choose_subprotocol("x, foxglove.websocket.v1,foxglove.sdk.v1"),
            "foxglove.websocket.v1");
  EXPECT_EQ(choose_subprotocol(""), std::nullopt);
  EXPECT_EQ(choose_subprotocol("foxglove.sdk.v2"), std::nullopt);
}

TEST(FoxgloveProtocol, AdvertisesChannels) {
  const Channel channel{7, "/a/\xff", "nav_msgs/msg/Odometry", "float64 x", Importance::kPose, 0};
  const json message = json::parse(advertise({&channel, 1}));
  EXPECT_EQ(message["op"], "advertise");
  const json& one = message["channels"][0];
  EXPECT_EQ(one["id"], 7);
  EXPECT_EQ(one["topic"], "/a/\xEF\xBF\xBD") << "text that is no UTF-8 is replaced";
  EXPECT_EQ(one["encoding"], "cdr");
  EXPECT_EQ(one["schemaName"], "nav_msgs/msg/Odometry");
  EXPECT_EQ(one["schemaEncoding"], "ros2msg");
}

TEST(FoxgloveProtocol, OffersPublishingOnlyWhenAllowed) {
  EXPECT_TRUE(json::parse(server_info("n", "s", false))["capabilities"].empty());
  EXPECT_EQ(json::parse(server_info("n", "s", true))["capabilities"][0], "clientPublish");
}

TEST(FoxgloveProtocol, WritesTheHeadOfAMessage) {
  const std::string head = message_head(0x01020304, 0x1112131415161718);
  EXPECT_EQ(head, std::string("\x01\x04\x03\x02\x01\x18\x17\x16\x15\x14\x13\x12\x11", 13));
}

TEST(FoxgloveProtocol, ReadsRequests) {
  const auto subscribe = parse_text(
      R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":2},{"id":3,"channelId":4}]})");
  ASSERT_TRUE(subscribe.ok()) << subscribe.error();
  const auto& items = std::get<Subscribe>(*subscribe).items;
  ASSERT_EQ(items.size(), 2U);
  EXPECT_EQ(items[1].subscription, 3U);
  EXPECT_EQ(items[1].channel, 4U);
  const auto unsubscribe = parse_text(R"({"op":"unsubscribe","subscriptionIds":[5]})");
  ASSERT_TRUE(unsubscribe.ok());
  EXPECT_EQ(std::get<Unsubscribe>(*unsubscribe).subscriptions, std::vector<std::uint32_t>{5});
  const auto advertised = parse_text(
      R"({"op":"advertise","channels":[{"id":1,"topic":"/t","encoding":"cdr","schemaName":"T"}]})");
  ASSERT_TRUE(advertised.ok());
  EXPECT_EQ(std::get<ClientAdvertise>(*advertised).items[0].topic, "/t");
  const auto other = parse_text(R"({"op":"getParameters"})");
  ASSERT_TRUE(other.ok());
  EXPECT_EQ(std::get<Unsupported>(*other).op, "getParameters");
}

TEST(FoxgloveProtocol, RefusesMalformedText) {
  for (const std::string text :
       {"", "{", "[]", "1", "null", R"({"op":1})", R"({"op":"subscribe"})",
        R"({"op":"subscribe","subscriptions":{}})", R"({"op":"subscribe","subscriptions":[1]})",
        R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":1}]})",
        R"({"op":"unsubscribe","subscriptionIds":["1"]})", "{\"op\":\"\xff\"}"}) {
    EXPECT_FALSE(parse_text(text).ok()) << text;
  }
  EXPECT_FALSE(parse_text(std::string(60000, '[')).ok()) << "deep nesting";
  EXPECT_FALSE(parse_text(R"({"op":")" + std::string(1000, 'x') + "\"}").ok());
  std::string many = R"({"op":"unsubscribe","subscriptionIds":[1)";
  for (int i = 0; i < 2000; ++i) many += ",1";
  EXPECT_FALSE(parse_text(many + "]}").ok());
}

TEST(FoxgloveProtocol, ReadsBinaryMessages) {
  const std::vector<std::uint8_t> bytes = {1, 2, 0, 0, 0, 9, 8};
  const auto message = parse_binary(bytes);
  ASSERT_TRUE(message.ok());
  EXPECT_EQ(message->channel, 2U);
  EXPECT_EQ(message->payload.size(), 2U);
  for (std::size_t length = 0; length < 5; ++length) {
    EXPECT_FALSE(parse_binary({bytes.data(), length}).ok());
  }
  EXPECT_FALSE(parse_binary(std::vector<std::uint8_t>{2, 0, 0, 0, 0}).ok());
}

TEST(FoxgloveProtocol, SurvivesDamagedText) {
  const std::string seeds[] = {
      R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":2}]})",
      R"({"op":"advertise","channels":[{"id":1,"topic":"/t","encoding":"cdr","schemaName":"T"}]})",
      R"({"op":"unsubscribe","subscriptionIds":[5,6,7]})"};
  std::mt19937 random(1);
  int accepted = 0;
  for (int i = 0; i < 20000; ++i) {
    std::string text = seeds[random() % 3];
    for (unsigned edits = 1 + random() % 4; edits > 0; --edits) {
      const std::size_t at = random() % text.size();
      switch (random() % 3) {
        case 0:
          text[at] = static_cast<char>(random());
          break;
        case 1:
          text.erase(at, 1 + random() % 5);
          break;
        default:
          text.insert(at, text.substr(random() % text.size(), random() % 20));
      }
      if (text.empty()) text = "{";
    }
    if (parse_text(text).ok()) ++accepted;
  }
  EXPECT_GT(accepted, 0);
  EXPECT_LT(accepted, 20000);
}

}  // namespace
}  // namespace sovo::bridge::foxglove
