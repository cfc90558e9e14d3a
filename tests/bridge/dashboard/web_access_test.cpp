#include "sovo/bridge/dashboard/web_access.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace sovo::bridge {
namespace {

WebRequest request(const std::string& host, const std::string& origin = "") {
  WebRequest r;
  r.host = host;
  r.origin = origin;
  return r;
}

AccessRules rules() {
  AccessConfig config;
  config.allowed_origins = {"https://app.foxglove.dev/"};
  config.host_names = {"Auv1", "auv1.local"};
  config.token = "0123456789abcdef0123";
  return AccessRules(config);
}

TEST(Access, TakesAddressesAndNamesOfThisMachine) {
  const AccessRules access = rules();
  for (const char* host : {"localhost:8765", "127.0.0.1:8765", "[::1]:8765", "192.168.1.4",
                           "auv1:8765", "AUV1.local", "[fe80::1]"}) {
    EXPECT_EQ(access.refusal(request(host)), std::nullopt) << host;
  }
}

TEST(Access, RefusesOtherHosts) {
  const AccessRules access = rules();
  for (const char* host : {"", "evil.example", "localhost.evil.example:8765", "127.0.0.1.nip.io",
                           "localhost:", "localhost:80x", "[::1", "localhost:1:2", "auv1.evil",
                           "localhost:8765; connect-src *", "127.0.0.1 evil"}) {
    EXPECT_NE(access.refusal(request(host)), std::nullopt) << host;
  }
}

TEST(Access, TakesTheOwnOriginNoneAndAllowedOnes) {
  const AccessRules access = rules();
  for (const char* origin :
       {"", "http://localhost:8765", "HTTP://LOCALHOST:8765", "https://app.foxglove.dev"}) {
    EXPECT_EQ(access.refusal(request("localhost:8765", origin)), std::nullopt) << origin;
  }
}

TEST(Access, RefusesOtherOrigins) {
  const AccessRules access = rules();
  for (const char* origin :
       {"http://evil.example", "http://localhost:8766", "null", "https://localhost:8765",
        "http://localhost:8765.evil.example", "https://app.foxglove.dev.evil.example"}) {
    EXPECT_NE(access.refusal(request("localhost:8765", origin)), std::nullopt) << origin;
  }
  WebRequest tls = request("localhost:8765", "https://localhost:8765");
  tls.tls = true;
  EXPECT_EQ(access.refusal(tls), std::nullopt);
}

TEST(Access, KnowsTheTokenAsQueryBearerAndCookie) {
  const AccessRules access = rules();
  WebRequest r = request("localhost");
  EXPECT_FALSE(access.is_known(r));
  r.query = "a=1&token=0123456789abcdef0123";
  EXPECT_TRUE(access.is_known(r));
  EXPECT_TRUE(access.has_token_in_query(r));
  r.query = "xtoken=0123456789abcdef0123";
  EXPECT_FALSE(access.is_known(r));
  r.query.clear();
  r.authorization = "Bearer 0123456789abcdef0123";
  EXPECT_TRUE(access.is_known(r));
  r.authorization = "Bearer 0123456789abcdef0124";
  EXPECT_FALSE(access.is_known(r));
  r.authorization.clear();
  const std::string cookie = access.session_cookie(false);
  EXPECT_EQ(cookie.find("0123456789abcdef0123"), std::string::npos) << "tells the token";
  EXPECT_NE(cookie.find("HttpOnly"), std::string::npos);
  EXPECT_NE(cookie.find("SameSite=Strict"), std::string::npos);
  EXPECT_EQ(cookie.find("Secure"), std::string::npos);
  EXPECT_NE(access.session_cookie(true).find("Secure"), std::string::npos);
  r.cookie = "other=1; " + cookie.substr(0, cookie.find(';'));
  EXPECT_TRUE(access.is_known(r));
  r.cookie.pop_back();
  EXPECT_FALSE(access.is_known(r));
}

TEST(Access, ComparesWhole) {
  EXPECT_TRUE(equal_in_constant_time("secret", "secret"));
  for (const char* given : {"", "s", "secre", "secretx", "secretsecret", "Secret"}) {
    EXPECT_FALSE(equal_in_constant_time(given, "secret")) << given;
  }
  EXPECT_FALSE(equal_in_constant_time("", ""));
}

class TokenFile : public testing::Test {
 protected:
  void SetUp() override {
    path_ = std::filesystem::temp_directory_path() / ("token_" + std::to_string(getpid()));
  }
  void TearDown() override { std::filesystem::remove(path_); }
  Result<std::string> read(const std::string& content, mode_t mode) {
    std::filesystem::remove(path_);
    std::ofstream(path_) << content;
    chmod(path_.c_str(), mode);
    return read_token_file(path_.string());
  }
  std::filesystem::path path_;
};

TEST_F(TokenFile, IsReadWhenItsOwnerAloneMay) {
  const auto token = read("0123456789abcdef\n", 0600);
  ASSERT_TRUE(token.ok()) << token.error();
  EXPECT_EQ(*token, "0123456789abcdef");
}

TEST_F(TokenFile, IsRefusedOtherwiseWithAdvice) {
  for (const mode_t mode : {0644U, 0660U, 0604U}) {
    const auto token = read("0123456789abcdef\n", mode);
    ASSERT_FALSE(token.ok());
    EXPECT_NE(token.error().find("chmod 600"), std::string::npos);
  }
  EXPECT_FALSE(read("short\n", 0600).ok());
  EXPECT_FALSE(read("", 0600).ok());
  EXPECT_FALSE(read("with spaces in it and more\n", 0600).ok());
  EXPECT_FALSE(read(std::string(2000, 'a'), 0600).ok());
  EXPECT_FALSE(read_token_file(path_.string() + ".missing").ok());
  EXPECT_FALSE(read_token_file("/").ok());
}

}  // namespace
}  // namespace sovo::bridge
