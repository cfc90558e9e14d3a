#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sovo/bridge/dashboard/web_types.h"
#include "sovo/io/result.h"

namespace sovo::bridge {

/// Reads a token: a file that its owner alone may read, with 16 or more letters, digits or -._~ and
/// a line end.
Result<std::string> read_token_file(const std::string& path);

/// Whether two texts are equal, in a time that depends on the length of `given` alone.
bool equal_in_constant_time(std::string_view given, std::string_view secret);

/// `count` random bytes as hexadecimal text.
std::string random_hex(std::size_t count);

/// Whether nothing from outside this machine can reach this address.
bool is_loopback_address(std::string_view address);

/// Who may look.
struct AccessConfig {
  std::vector<std::string> allowed_origins;  ///< "https://app.foxglove.dev": beside the own one.
  std::vector<std::string> host_names;       ///< This machine's names, beside localhost.
  std::string token;                         ///< Empty: none is asked for.
  std::string cookie_name = "sovo_session";
};

/// Decides about requests by Host, Origin and token. Any page in a browser on this machine could
/// speak to the port, so Host and Origin are checked on loopback too.
class AccessRules {
 public:
  explicit AccessRules(AccessConfig config);

  /// Why this request comes from where it must not; nothing when it is fine. Host must be an
  /// address or a name of this machine, for a name that somebody else owns can be made to point
  /// here; Origin must be absent, the server's own, or allowed.
  std::optional<std::string> refusal(const WebRequest& request) const;

  /// Whether the request carries the token, as `?token=`, bearer or session cookie, or none is
  /// asked for.
  bool is_known(const WebRequest& request) const;

  /// Whether the token stands in the address.
  bool has_token_in_query(const WebRequest& request) const;

  /// Value of Set-Cookie for one who has shown the token.
  std::string session_cookie(bool tls) const;

 private:
  bool is_own_name(std::string_view host) const;

  AccessConfig config_;
  std::string session_;  // what the cookie holds, so that it does not tell the token
};

}  // namespace sovo::bridge
