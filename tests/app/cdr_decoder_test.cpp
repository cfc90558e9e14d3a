#include "sovo/app/cdr_decoder.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "sovo/app/message_text.h"
#include "sovo/app/rate_meter.h"
#include "sovo/bridge/message_schema.h"

namespace sovo::app {
namespace {

const std::string kDefinition = R"(# A comment.
uint8 KIND=3
uint8 kind      # another
inner_msgs/Inner inner
float64[2] pair
Local[] locals
string<=16 text
)" + std::string(80, '=') + R"(
MSG: inner_msgs/Inner
int16 value
float32[] numbers
)" + std::string(80, '=') + R"(
MSG: test_msgs/Local
bool yes
)";

/// kind 7; inner { -2, [0.5] }; pair [1, 2]; locals [true, false]; text "ab".
std::vector<std::uint8_t> little_endian_sample() {
  return {0, 1, 0, 0, 7, 0, 0xFE, 0xFF, 1, 0, 0, 0, 0, 0, 0, 0x3F, 0, 0, 0, 0, 0,   0,   0xF0, 0x3F,
          0, 0, 0, 0, 0, 0, 0,    0x40, 2, 0, 0, 0, 1, 0, 0, 0,    3, 0, 0, 0, 'a', 'b', 0};
}

CdrDecoder decoder() {
  auto made = CdrDecoder::make("test_msgs/msg/Test", kDefinition);
  if (!made) throw std::runtime_error(made.error());
  return *made;
}

TEST(CdrDecoder, ReadsNestedTypesArraysAndTexts) {
  // The doubles begin at offset 12 after the header, and are aligned to 16.
  auto bytes = little_endian_sample();
  bytes.insert(bytes.begin() + 16, 4, 0);
  const auto message = decoder().decode(bytes);
  ASSERT_TRUE(message.ok()) << message.error();
  EXPECT_EQ(message->dump(), R"({"kind":7,"inner":{"value":-2,"numbers":[0.5]},"pair":[1.0,2.0],)"
                             R"("locals":[{"yes":true},{"yes":false}],"text":"ab"})");
}

TEST(CdrDecoder, ReadsBigEndianToo) {
  const auto made = CdrDecoder::make("a/msg/B", "uint32 x\nint16 y\n");
  ASSERT_TRUE(made.ok());
  const std::vector<std::uint8_t> bytes = {0, 0, 0, 0, 0, 0, 1, 2, 0xFF, 0xFD};
  const auto message = made->decode(bytes);
  ASSERT_TRUE(message.ok()) << message.error();
  EXPECT_EQ((*message)["x"], 258);
  EXPECT_EQ((*message)["y"], -3);
}

TEST(CdrDecoder, SaysWhereAMessageIsCutOrLies) {
  auto bytes = little_endian_sample();
  bytes.insert(bytes.begin() + 16, 4, 0);
  auto cut = bytes;
  cut.resize(14);
  EXPECT_NE(decoder().decode(cut).error().find("numbers"), std::string::npos);
  bytes[36] = bytes[39] = 0xFF;  // the length of `locals`
  const auto lying = decoder().decode(bytes);
  ASSERT_FALSE(lying.ok());
  EXPECT_NE(lying.error().find("locals"), std::string::npos) << lying.error();
  EXPECT_FALSE(decoder().decode(std::vector<std::uint8_t>{0, 9}).ok());
}

TEST(CdrDecoder, DefinitionsThatLackATypeAreRefused) {
  EXPECT_FALSE(CdrDecoder::make("a/msg/B", "other_msgs/C c\n").ok());
  EXPECT_FALSE(CdrDecoder::make("a/msg/B", "uint8[x] c\n").ok());
}

TEST(CdrDecoder, AllKnownTypesAreUnderstoodAndRandomBytesSurvived) {
  std::mt19937 random(3);
  int decoded = 0;
  for (const bridge::MessageSchema& schema : bridge::message_schemas()) {
    const auto made = CdrDecoder::make(schema.ros_name, schema.definition);
    ASSERT_TRUE(made.ok()) << made.error();
    for (int i = 0; i < 50; ++i) {
      std::vector<std::uint8_t> bytes(random() % 400, 0);
      for (auto& byte : bytes) byte = random() % 3 == 0 ? static_cast<std::uint8_t>(random()) : 0;
      if (bytes.size() >= 4) bytes[0] = bytes[2] = 0, bytes[1] = 1;
      decoded += made->decode(bytes).ok() ? 1 : 0;
    }
  }
  EXPECT_GT(decoded, 0);
}

TEST(MessageText, CutsLongArrays) {
  nlohmann::ordered_json message;
  message["name"] = "x";
  message["data"] = std::vector<int>(20, 5);
  message["points"] = nlohmann::ordered_json::array({{{"u", 1}}});
  const std::string text = message_text(message);
  EXPECT_NE(text.find("name: \"x\"\ndata: [5, 5,"), std::string::npos) << text;
  EXPECT_NE(text.find("20 in all]"), std::string::npos) << text;
  EXPECT_NE(text.find("points:\n  - 0\n    u: 1"), std::string::npos) << text;
}

TEST(RateMeter, TellsRateAndBandwidthOfTheLastSeconds) {
  RateMeter meter;
  const RateMeter::Clock::time_point begin{std::chrono::hours(1)};
  EXPECT_FALSE(meter.rate(begin));
  for (int i = 0; i < 300; ++i) meter.add(begin + i * std::chrono::milliseconds(50), 1000);
  const auto rate = meter.rate(begin + std::chrono::seconds(15));
  ASSERT_TRUE(rate);
  EXPECT_NEAR(rate->hertz, 20.0, 1e-9);
  EXPECT_NEAR(rate->bytes_per_s, 20000.0, 1e-6);
  EXPECT_LE(rate->messages, 201U);
  EXPECT_NEAR(rate->deviation_s, 0.0, 1e-9);
  EXPECT_FALSE(meter.rate(begin + std::chrono::seconds(40))) << "silence has no rate";
}

}  // namespace
}  // namespace sovo::app
