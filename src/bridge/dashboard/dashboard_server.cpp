#include "sovo/bridge/dashboard/dashboard_server.h"

#include <unistd.h>

#include <array>

#include "sovo/bridge/dashboard/vehicle_metrics.h"

namespace sovo::bridge {
namespace {

constexpr const char* kNoPage =
    "The web page was not built with this program.\n\n"
    "Build it with Node 18 or newer: install nodejs and npm (on Debian: apt-get install nodejs "
    "npm), then run scripts/build again, and install again where sovo is installed.\n\n"
    "Foxglove can connect to this address all the same.\n";

AccessConfig access_config(const DashboardServerConfig& config) {
  AccessConfig access;
  access.allowed_origins = config.allowed_origins;
  access.token = config.token;
  // Cookies are shared by all ports of a host.
  access.cookie_name = "sovo_session_" + std::to_string(config.web.port);
  std::array<char, 256> name{};
  if (gethostname(name.data(), name.size() - 1) == 0 && name[0] != '\0') {
    access.host_names = {name.data(), std::string(name.data()) + ".local"};
  }
  return access;
}

WebResponse plain(unsigned status, const std::string& text) {
  WebResponse response;
  response.status = status;
  response.body = text;
  return response;
}

/// Nothing but the page's own files and socket; `host` was checked to be a host's name.
std::string content_security_policy(const WebRequest& request) {
  return "default-src 'none'; script-src 'self'; style-src 'self'; font-src 'self'; "
         "img-src 'self' blob: data:; connect-src 'self' " +
         std::string(request.tls ? "wss://" : "ws://") + request.host +
         "; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
}

void harden(const WebRequest& request, WebResponse* response) {
  auto& headers = response->headers;
  headers.emplace_back("Content-Security-Policy", content_security_policy(request));
  headers.emplace_back("X-Content-Type-Options", "nosniff");
  headers.emplace_back("X-Frame-Options", "DENY");
  headers.emplace_back("Referrer-Policy", "no-referrer");
  headers.emplace_back("Cross-Origin-Opener-Policy", "same-origin");
  headers.emplace_back("Cross-Origin-Resource-Policy", "same-origin");
}

}  // namespace

DashboardServer::DashboardServer(const DashboardServerConfig& config, MessageBus& bus)
    : config_(config),
      bus_(bus),
      access_(access_config(config)),
      files_(StaticFiles::read(config.page)),
      hub_(bus, config.hub) {}

DashboardServer::~DashboardServer() {
  bus_.stop();
  web_.reset();
}

Result<std::unique_ptr<DashboardServer>> DashboardServer::open(const DashboardServerConfig& config,
                                                               MessageBus& bus) {
  std::unique_ptr<DashboardServer> server(new DashboardServer(config, bus));
  auto web = WebServer::open(config.web, *server);
  if (!web) return web.failure();
  server->web_ = std::move(*web);
  bus.start(server->hub_);
  return server;
}

std::optional<WebResponse> DashboardServer::refusal(const WebRequest& request) const {
  if (const auto reason = access_.refusal(request)) return plain(403, *reason + "\n");
  if (access_.is_known(request)) return std::nullopt;
  WebResponse response = plain(401,
                               "A token is needed: open this address with ?token=... at its end; "
                               "the token stands in the file given as --token-file.\n");
  response.headers.emplace_back("WWW-Authenticate", "Bearer");
  return response;
}

WebResponse DashboardServer::respond(const WebRequest& request) {
  WebResponse response;
  if (request.method != "GET" && request.method != "HEAD") {
    response = plain(405, "only GET and HEAD\n");
  } else if (request.path == "/healthz") {
    response = access_.refusal(request) ? plain(403, "forbidden\n") : plain(200, "ok\n");
  } else if (auto refused = refusal(request)) {
    response = std::move(*refused);
  } else if (request.path == "/metrics") {
    response = metrics();
  } else {
    response = page(request);
  }
  // A refused Host is not repeated in a header.
  WebRequest checked = request;
  if (response.status == 403) checked.host = "localhost";
  harden(checked, &response);
  return response;
}

WebResponse DashboardServer::page(const WebRequest& request) const {
  if (request.path == "/" && access_.has_token_in_query(request)) {
    WebResponse response = plain(303, "");
    response.headers.emplace_back("Location", "/");
    response.headers.emplace_back("Set-Cookie", access_.session_cookie(request.tls));
    response.headers.emplace_back("Cache-Control", "no-store");
    return response;
  }
  if (files_.empty() && request.path == "/") return plain(503, kNoPage);
  const StaticFile* file = files_.find(request.path);
  if (file == nullptr) return plain(404, "there is no such page\n");
  WebResponse response;
  response.content_type = file->content_type;
  response.headers.emplace_back("ETag", file->etag);
  response.headers.emplace_back("Cache-Control", "no-cache");
  if (request.if_none_match == file->etag) {
    response.status = 304;
  } else {
    response.body = file->body;
  }
  return response;
}

WebResponse DashboardServer::metrics() const {
  const HubCounters counters = hub_.counters();
  const auto add = [](const char* name, const char* type, auto value) {
    return std::string("# TYPE ") + name + " " + type + "\n" +
           prometheus_sample(name, {}, static_cast<double>(value));
  };
  WebResponse response;
  response.content_type = "text/plain; version=0.0.4; charset=utf-8";
  response.body = add("sovo_dashboard_clients", "gauge", counters.clients) +
                  add("sovo_dashboard_channels", "gauge", counters.channels) +
                  add("sovo_dashboard_queued_bytes", "gauge", counters.queued_bytes) +
                  add("sovo_dashboard_forwarded_total", "counter", counters.forwarded) +
                  add("sovo_dashboard_missed_total", "counter", counters.missed) +
                  add("sovo_dashboard_commands_total", "counter", counters.commands) +
                  add("sovo_dashboard_malformed_total", "counter", counters.malformed) +
                  bus_.metrics();
  return response;
}

std::variant<WebUpgrade, WebResponse> DashboardServer::upgrade(const WebRequest& request) {
  if (auto refused = refusal(request)) return std::move(*refused);
  const auto subprotocol = foxglove::choose_subprotocol(request.subprotocols);
  if (!subprotocol) {
    return plain(400,
                 "this WebSocket speaks the subprotocols foxglove.sdk.v1 and "
                 "foxglove.websocket.v1\n");
  }
  return WebUpgrade{*subprotocol, hub_.make_client()};
}

}  // namespace sovo::bridge
