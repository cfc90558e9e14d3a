#include "sovo/bridge/dashboard/dashboard_server.h"

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <random>

#include "bridge/test_bus.h"
#include "test_web_client.h"

namespace sovo::bridge {
namespace {

using nlohmann::json;

constexpr const char* kToken = "0123456789abcdef";

/// A bus without DDS.
class FakeBus : public MessageBus {
 public:
  void start(BusListener& to) override { listener = &to; }
  void stop() override { listener = nullptr; }
  void want(std::uint32_t channel, bool is_wanted) override {
    const std::lock_guard lock(mutex);
    wanted[channel] = is_wanted;
  }
  Result<void> prepare(const std::string& topic, const std::string&) override {
    if (topic == "/sovo/command") return {};
    return Error{"only commands"};
  }
  Result<void> publish(const std::string&, std::span<const std::uint8_t> payload) override {
    const std::lock_guard lock(mutex);
    published.emplace_back(payload.begin(), payload.end());
    return {};
  }
  std::string metrics() override { return "sovo_vo_state 1\n"; }

  bool is_wanted(std::uint32_t channel) {
    const std::lock_guard lock(mutex);
    return wanted[channel];
  }
  std::size_t num_published() {
    const std::lock_guard lock(mutex);
    return published.size();
  }

  void add(std::uint32_t id, const std::string& topic, Importance importance, int latched = 0) {
    listener->on_channel({id, topic, "pkg/msg/Type", "float64 x", importance, latched});
  }
  void send(std::uint32_t id, std::size_t bytes, std::uint8_t fill, std::int64_t stamp = 5) {
    listener->on_message(id, stamp, std::make_shared<const std::vector<std::uint8_t>>(bytes, fill));
  }

  BusListener* listener = nullptr;
  std::mutex mutex;
  std::map<std::uint32_t, bool> wanted;
  std::vector<std::vector<std::uint8_t>> published;
};

class Dashboard : public testing::Test {
 protected:
  void SetUp() override {
    page_ = std::filesystem::temp_directory_path() / ("page_" + std::to_string(getpid()));
    std::filesystem::create_directories(page_ / "assets");
    std::ofstream(page_ / "index.html") << "<html>page</html>";
    std::ofstream(page_ / "assets" / "a.js") << "code";
    config_.web.port = 0;
    config_.page = page_;
  }
  void TearDown() override {
    server_.reset();
    std::filesystem::remove_all(page_);
  }

  void open() { server_ = require(DashboardServer::open(config_, bus_)); }
  std::string get(const std::string& target, const std::string& headers = "") {
    return TestWebClient(server_->port()).get(target, headers);
  }
  std::string status_of(const std::string& target, const std::string& headers = "") {
    return get(target, headers).substr(9, 3);
  }
  /// A client that has heard of the channels and subscribed to one as number 1.
  std::unique_ptr<TestWebClient> subscribed(std::uint32_t channel, int receive_buffer = 0) {
    auto client = std::make_unique<TestWebClient>(server_->port(), receive_buffer);
    EXPECT_EQ(client->upgrade(), "HTTP/1.1 101 Switching Protocols");
    EXPECT_NE(client->receive_text_with("advertise"), "");
    client->send_text(R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":)" +
                      std::to_string(channel) + "}]}");
    EXPECT_TRUE(eventually([&] { return bus_.is_wanted(channel); }));
    return client;
  }

  std::filesystem::path page_;
  DashboardServerConfig config_;
  FakeBus bus_;
  std::unique_ptr<DashboardServer> server_;
};

TEST_F(Dashboard, ServesThePageAndNothingElse) {
  open();
  const std::string page = get("/");
  EXPECT_EQ(page.substr(9, 3), "200");
  EXPECT_NE(page.find("<html>page</html>"), std::string::npos);
  EXPECT_NE(page.find("Content-Security-Policy: default-src 'none'; script-src 'self'"),
            std::string::npos);
  EXPECT_NE(page.find("nosniff"), std::string::npos);
  EXPECT_NE(get("/assets/a.js").find("text/javascript"), std::string::npos);
  for (const char* target :
       {"/../index.html", "/assets/../../secret", "/etc/passwd", "//", "/%2e"}) {
    EXPECT_EQ(status_of(target), "404") << target;
  }
}

TEST_F(Dashboard, SaysHowToBuildAMissingPage) {
  config_.page = page_ / "missing";
  open();
  const std::string answer = get("/");
  EXPECT_EQ(answer.substr(9, 3), "503");
  EXPECT_NE(answer.find("npm"), std::string::npos);
  EXPECT_FALSE(server_->has_page());
}

TEST_F(Dashboard, AnswersHealthAndMetrics) {
  open();
  EXPECT_EQ(status_of("/healthz"), "200");
  const std::string metrics = get("/metrics");
  EXPECT_NE(metrics.find("# TYPE sovo_dashboard_clients gauge\nsovo_dashboard_clients 0\n"),
            std::string::npos)
      << metrics;
  EXPECT_NE(metrics.find("sovo_vo_state 1"), std::string::npos);
}

TEST_F(Dashboard, RefusesForeignHostsAndOrigins) {
  open();
  EXPECT_EQ(status_of("/", "Host: evil.example\r\n"), "403");
  EXPECT_EQ(status_of("/metrics", "Origin: http://evil.example\r\n"), "403");
  EXPECT_EQ(status_of("/healthz", "Host: evil.example\r\n"), "403");
  EXPECT_NE(TestWebClient(server_->port()).upgrade("Origin: http://evil.example\r\n").find("403"),
            std::string::npos);
  EXPECT_NE(TestWebClient(server_->port()).upgrade("Host: evil.example\r\n").find("403"),
            std::string::npos);
  EXPECT_NE(TestWebClient(server_->port()).upgrade("", "").find("400"), std::string::npos);
}

TEST_F(Dashboard, AsksForTheTokenAndGivesACookie) {
  config_.token = kToken;
  open();
  const std::string with_token = std::string("/?token=") + kToken;
  EXPECT_EQ(status_of("/"), "401");
  EXPECT_EQ(status_of("/assets/a.js"), "401");
  EXPECT_EQ(status_of("/metrics"), "401");
  EXPECT_EQ(status_of("/healthz"), "200");
  EXPECT_EQ(status_of("/?token=wrong"), "401");
  EXPECT_EQ(status_of("/metrics", std::string("Authorization: Bearer ") + kToken + "\r\n"), "200");
  EXPECT_NE(TestWebClient(server_->port()).upgrade().find("401"), std::string::npos);
  const std::string answer = get(with_token);
  EXPECT_EQ(answer.substr(9, 3), "303");
  EXPECT_NE(answer.find("Location: /\r\n"), std::string::npos);
  const auto at = answer.find("Set-Cookie: ");
  ASSERT_NE(at, std::string::npos);
  const std::string cookie = answer.substr(at + 12, answer.find(';', at) - at - 12);
  EXPECT_EQ(status_of("/", "Cookie: " + cookie + "\r\n"), "200");
  EXPECT_NE(TestWebClient(server_->port()).upgrade("Cookie: " + cookie + "\r\n").find("101"),
            std::string::npos);
  EXPECT_NE(TestWebClient(server_->port()).upgrade("", "foxglove.sdk.v1", with_token).find("101"),
            std::string::npos);
}

TEST_F(Dashboard, PassesMessagesOnByBothSubprotocols) {
  open();
  bus_.add(3, "/sovo/status", Importance::kPose);
  for (const char* subprotocol : {"foxglove.sdk.v1", "foxglove.websocket.v1"}) {
    TestWebClient client(server_->port());
    EXPECT_EQ(client.upgrade("", subprotocol), "HTTP/1.1 101 Switching Protocols");
    EXPECT_NE(client.head().find(subprotocol), std::string::npos);
    EXPECT_EQ(json::parse(client.receive_text_with("serverInfo"))["op"], "serverInfo");
    EXPECT_EQ(json::parse(client.receive_text_with("advertise"))["channels"][0]["topic"],
              "/sovo/status");
    client.send_text(R"({"op":"subscribe","subscriptions":[{"id":9,"channelId":3}]})");
    ASSERT_TRUE(eventually([&] { return bus_.is_wanted(3); }));
    bus_.send(3, 4, 0xAB, 0x0102);
    EXPECT_EQ(client.receive_binary(),
              std::string("\x01\x09\0\0\0\x02\x01\0\0\0\0\0\0\xAB\xAB\xAB\xAB", 17));
    client.send_text(R"({"op":"unsubscribe","subscriptionIds":[9]})");
    EXPECT_TRUE(eventually([&] { return !bus_.is_wanted(3); }));
  }
}

TEST_F(Dashboard, TellsOfChannelsThatComeAndGo) {
  open();
  TestWebClient client(server_->port());
  client.upgrade();
  EXPECT_NE(client.receive_text_with("serverInfo"), "");
  bus_.add(3, "/sovo/status", Importance::kPose);
  EXPECT_NE(client.receive_text_with("advertise"), "");
  bus_.listener->on_channel_gone(3);
  EXPECT_EQ(json::parse(client.receive_text_with("unadvertise"))["channelIds"][0], 3);
}

TEST_F(Dashboard, GivesLateSubscribersWhatIsLatched) {
  open();
  bus_.add(4, "/sovo/keyframe", Importance::kCloud, 2);
  const auto first = subscribed(4);
  for (std::uint8_t i = 1; i <= 3; ++i) bus_.send(4, 1, i);
  for (char i = 1; i <= 3; ++i) EXPECT_EQ(first->receive_binary().back(), i);
  const auto late = subscribed(4);
  EXPECT_EQ(late->receive_binary().back(), 2);
  EXPECT_EQ(late->receive_binary().back(), 3);
}

TEST_F(Dashboard, LetsGoOfWhatAClosedClientWanted) {
  open();
  bus_.add(3, "/sovo/status", Importance::kPose);
  auto client = subscribed(3);
  client.reset();
  EXPECT_TRUE(eventually([&] { return !bus_.is_wanted(3); }));
  EXPECT_TRUE(eventually([&] { return server_->counters().clients == 0; }));
}

TEST_F(Dashboard, TellsASlowClientWhatItMissedAndKeepsPoses) {
  config_.hub.queue_bytes = 200'000;
  open();
  bus_.add(1, "/sovo/left/preview/compressed", Importance::kImage);
  bus_.add(2, "/sovo/status", Importance::kPose);
  const auto client = subscribed(1, 4096);
  client->send_text(R"({"op":"subscribe","subscriptions":[{"id":2,"channelId":2}]})");
  ASSERT_TRUE(eventually([&] { return bus_.is_wanted(2); }));
  constexpr int kPoses = 200;
  for (int i = 0; i < kPoses; ++i) {
    bus_.send(1, 60'000, 7);
    bus_.send(2, 100, static_cast<std::uint8_t>(i));
  }
  EXPECT_LE(server_->counters().queued_bytes, 200'000U);
  EXPECT_GT(server_->counters().missed, 100U);
  int poses = 0;
  int images = 0;
  std::string told;
  while (poses < kPoses) {
    const auto frame = client->receive();
    ASSERT_TRUE(frame.has_value());
    if (frame->opcode == 1) told += frame->payload;
    if (frame->opcode == 2) ++(frame->payload[1] == 2 ? poses : images);
  }
  EXPECT_EQ(poses, kPoses);
  EXPECT_LT(images, 100);
  if (told.empty()) told = client->receive_text_with("left out");
  EXPECT_NE(told.find("of /sovo/left/preview/compressed"), std::string::npos) << told;
}

TEST_F(Dashboard, AStalledClientLeavesOthersAlone) {
  open();
  bus_.add(1, "/sovo/status", Importance::kPose);
  const auto stalled = subscribed(1, 4096);
  const auto lively = subscribed(1);
  // Requests are answered in order: after this answer the second client is subscribed.
  lively->send_text(R"({"op":"sync"})");
  ASSERT_NE(lively->receive_text_with("'sync' is not offered"), "");
  for (int i = 0; i < 300; ++i) {
    bus_.send(1, 50'000, 1);
    ASSERT_FALSE(lively->receive_binary().empty());
  }
  EXPECT_LE(server_->counters().queued_bytes, config_.hub.queue_bytes);
}

TEST_F(Dashboard, PublishesCommandsOnlyWhenAllowed) {
  const std::string advertise =
      R"({"op":"advertise","channels":[{"id":1,"topic":"/sovo/command","encoding":"cdr","schemaName":"T"}]})";
  const std::string command("\x01\x01\0\0\0\0\x01\0\0command", 16);
  open();
  {
    TestWebClient client(server_->port());
    client.upgrade();
    client.send_text(advertise);
    EXPECT_NE(client.receive_text_with("only shows"), "");
    client.send_frame(2, command);
    EXPECT_NE(client.receive_text_with("not open for publishing"), "");
  }
  EXPECT_EQ(bus_.num_published(), 0U);
  server_.reset();
  config_.hub.allow_commands = true;
  open();
  TestWebClient client(server_->port());
  client.upgrade();
  EXPECT_NE(client.receive_text_with("clientPublish"), "");
  client.send_text(advertise);
  client.send_frame(2, command);
  EXPECT_TRUE(eventually([&] { return bus_.num_published() == 1; }));
  EXPECT_EQ(bus_.published[0].size(), 11U);
}

TEST_F(Dashboard, ClosesOnMalformedAndOversizedMessages) {
  open();
  bus_.add(1, "/sovo/status", Importance::kPose);
  const std::string bad[] = {"{", "", std::string(100'000, ' ')};
  for (const std::string& text : bad) {
    const auto client = subscribed(1);
    client->send_text(text);
    EXPECT_EQ(client->receive_text_with("never said"), "") << "the connection is closed";
  }
  const auto client = subscribed(1);
  client->send_frame(2, "\x07");
  EXPECT_EQ(client->receive_text_with("never said"), "");
  EXPECT_TRUE(eventually([&] { return server_->counters().clients == 0; }));
  EXPECT_GE(server_->counters().malformed, 3U);
}

TEST_F(Dashboard, RefusesMoreConnectionsThanItsLimit) {
  config_.web.max_connections = 3;
  open();
  std::vector<std::unique_ptr<TestWebClient>> clients;
  for (int i = 0; i < 3; ++i) {
    clients.push_back(std::make_unique<TestWebClient>(server_->port()));
    EXPECT_EQ(clients.back()->upgrade(), "HTTP/1.1 101 Switching Protocols");
  }
  EXPECT_EQ(TestWebClient(server_->port()).upgrade(), "");
  clients.clear();
  EXPECT_TRUE(eventually([&] {
    return TestWebClient(server_->port()).upgrade() == "HTTP/1.1 101 Switching Protocols";
  }));
}

TEST_F(Dashboard, SurvivesDamagedBytes) {
  open();
  bus_.add(1, "/sovo/status", Importance::kPose);
  std::mt19937 random(7);
  const auto noise = [&](std::size_t length) {
    std::string bytes(length, '\0');
    for (char& c : bytes) c = static_cast<char>(random());
    return bytes;
  };
  for (int i = 0; i < 150; ++i) {
    TestWebClient client(server_->port());
    if (i % 3 == 0) {
      client.send_raw("GET " + noise(random() % 200) + " HTTP/1.1\r\n" + noise(random() % 300) +
                      "\r\n\r\n");
      continue;
    }
    ASSERT_EQ(client.upgrade(), "HTTP/1.1 101 Switching Protocols");
    if (i % 3 == 1) client.send_raw(noise(1 + random() % 2000));
    if (i % 3 == 2) client.send_frame(1 + static_cast<int>(random() % 2), noise(random() % 500));
  }
  EXPECT_EQ(status_of("/healthz"), "200");
  EXPECT_TRUE(eventually([&] { return server_->counters().clients == 0; }));
}

}  // namespace
}  // namespace sovo::bridge
