#include "sovo/bridge/dashboard/web_access.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <openssl/crypto.h>
#include <openssl/rand.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace sovo::bridge {
namespace {

constexpr std::size_t kShortestToken = 16;
constexpr std::size_t kLongestToken = 512;

struct FileDescriptor {
  explicit FileDescriptor(int fd) : fd_(fd) {}
  ~FileDescriptor() {
    if (fd_ >= 0) close(fd_);
  }
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  int fd_;
};

bool is_token_character(unsigned char c) {
  return std::isalnum(c) != 0 || c == '-' || c == '.' || c == '_' || c == '~';
}

std::string lower(std::string_view text) {
  std::string result(text);
  std::transform(result.begin(), result.end(), result.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return result;
}

/// The host of "host:port" or "[address]:port", lower case; empty when it is not of that form.
std::string host_of(std::string_view authority) {
  std::string_view host = authority;
  std::string_view rest;
  if (authority.starts_with('[')) {
    const auto end = authority.find(']');
    if (end == std::string_view::npos) return "";
    host = authority.substr(1, end - 1);
    rest = authority.substr(end + 1);
  } else if (const auto colon = authority.find(':'); colon != std::string_view::npos) {
    host = authority.substr(0, colon);
    rest = authority.substr(colon);
  }
  const bool port_is_fine =
      rest.empty() || (rest.starts_with(':') && rest.size() > 1 && rest.size() <= 6 &&
                       rest.find_first_not_of("0123456789", 1) == std::string_view::npos);
  return port_is_fine ? lower(host) : "";
}

bool is_ip_address(const std::string& host) {
  std::array<unsigned char, 16> bytes{};
  return inet_pton(AF_INET, host.c_str(), bytes.data()) == 1 ||
         inet_pton(AF_INET6, host.c_str(), bytes.data()) == 1;
}

/// Value of `name` in "a=1&b=2" or "a=1; b=2".
std::string_view value_of(std::string_view list, std::string_view name, char separator) {
  while (!list.empty()) {
    const auto end = list.find(separator);
    std::string_view item = list.substr(0, end);
    while (item.starts_with(' ')) item.remove_prefix(1);
    if (item.size() > name.size() && item.starts_with(name) && item[name.size()] == '=') {
      return item.substr(name.size() + 1);
    }
    if (end == std::string_view::npos) break;
    list.remove_prefix(end + 1);
  }
  return {};
}

Error token_error(const std::string& path, const std::string& what) {
  return Error{"token file " + path + ": " + what +
               "; make one with: (umask 077; openssl rand -hex 32 > " + path + ")"};
}

}  // namespace

Result<std::string> read_token_file(const std::string& path) {
  const FileDescriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.fd_ < 0) return token_error(path, std::strerror(errno));
  struct stat info {};
  if (fstat(file.fd_, &info) != 0) return token_error(path, std::strerror(errno));
  if (!S_ISREG(info.st_mode)) return token_error(path, "is not a file");
  if ((info.st_mode & 077U) != 0) {
    return Error{"token file " + path + ": others may read it; chmod 600 " + path};
  }
  std::array<char, kLongestToken + 2> buffer{};
  const ssize_t length = read(file.fd_, buffer.data(), buffer.size());
  if (length < 0) return token_error(path, std::strerror(errno));
  std::string token(buffer.data(), static_cast<std::size_t>(length));
  while (!token.empty() && std::isspace(static_cast<unsigned char>(token.back())) != 0) {
    token.pop_back();
  }
  if (token.size() < kShortestToken || token.size() > kLongestToken) {
    return token_error(path, "a token has 16 to 512 characters");
  }
  if (!std::all_of(token.begin(), token.end(), is_token_character)) {
    return token_error(path, "a token is of letters, digits and -._~, on one line");
  }
  return token;
}

bool equal_in_constant_time(std::string_view given, std::string_view secret) {
  if (secret.empty()) return false;
  unsigned char difference = given.size() == secret.size() ? 0 : 1;
  for (std::size_t i = 0; i < given.size(); ++i) {
    const unsigned char expected = static_cast<unsigned char>(secret[i % secret.size()]);
    difference =
        static_cast<unsigned char>(difference | (static_cast<unsigned char>(given[i]) ^ expected));
  }
  return difference == 0;
}

std::string random_hex(std::size_t count) {
  std::vector<unsigned char> bytes(count);
  if (RAND_bytes(bytes.data(), static_cast<int>(count)) != 1) {
    throw std::runtime_error("this machine gives no random numbers");
  }
  std::string text;
  for (const unsigned char byte : bytes) {
    text += "0123456789abcdef"[byte >> 4U];
    text += "0123456789abcdef"[byte & 15U];
  }
  return text;
}

bool is_loopback_address(std::string_view address) {
  return address == "::1" || address == "localhost" ||
         (address.starts_with("127.") && is_ip_address(std::string(address)));
}

AccessRules::AccessRules(AccessConfig config)
    : config_(std::move(config)), session_(random_hex(32)) {
  for (std::string& name : config_.host_names) name = lower(name);
  for (std::string& origin : config_.allowed_origins) {
    origin = lower(origin);
    while (origin.ends_with('/')) origin.pop_back();
  }
}

bool AccessRules::is_own_name(std::string_view host) const {
  const std::string name = host_of(host);
  return name == "localhost" || is_ip_address(name) ||
         (!name.empty() && std::find(config_.host_names.begin(), config_.host_names.end(), name) !=
                               config_.host_names.end());
}

std::optional<std::string> AccessRules::refusal(const WebRequest& request) const {
  if (!is_own_name(request.host)) {
    return "this is not '" + request.host +
           "': use the machine's address or name, or localhost, in the address";
  }
  if (request.origin.empty()) return std::nullopt;
  const std::string origin = lower(request.origin);
  if (origin == (request.tls ? "https://" : "http://") + lower(request.host)) return std::nullopt;
  const auto& allowed = config_.allowed_origins;
  if (std::find(allowed.begin(), allowed.end(), origin) != allowed.end()) return std::nullopt;
  return "pages of '" + request.origin + "' may not look here; sovo dashboard --allow-origin " +
         request.origin + " lets them";
}

bool AccessRules::has_token_in_query(const WebRequest& request) const {
  return equal_in_constant_time(value_of(request.query, "token", '&'), config_.token);
}

bool AccessRules::is_known(const WebRequest& request) const {
  if (config_.token.empty()) return true;
  constexpr std::string_view kBearer = "Bearer ";
  const std::string_view authorization = request.authorization;
  return has_token_in_query(request) ||
         equal_in_constant_time(value_of(request.cookie, config_.cookie_name, ';'), session_) ||
         (authorization.starts_with(kBearer) &&
          equal_in_constant_time(authorization.substr(kBearer.size()), config_.token));
}

std::string AccessRules::session_cookie(bool tls) const {
  return config_.cookie_name + "=" + session_ + "; Path=/; HttpOnly; SameSite=Strict" +
         (tls ? "; Secure" : "");
}

}  // namespace sovo::bridge
