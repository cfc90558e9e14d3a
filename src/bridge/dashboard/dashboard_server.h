#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "sovo/bridge/dashboard/foxglove_hub.h"
#include "sovo/bridge/dashboard/static_files.h"
#include "sovo/bridge/dashboard/web_access.h"
#include "sovo/bridge/dashboard/web_server.h"

namespace sovo::bridge {

struct DashboardServerConfig {
  WebServerConfig web;
  HubConfig hub;
  std::vector<std::string> allowed_origins;
  std::string token;  ///< Empty: none is asked for.
  std::filesystem::path page = page_folder();
};

/// Serves the web page, Foxglove's protocol, `/metrics` and `/healthz` on one port, from a bus.
class DashboardServer : public WebHandler {
 public:
  /// Serves until the object ends; the bus must outlive it.
  static Result<std::unique_ptr<DashboardServer>> open(const DashboardServerConfig& config,
                                                       MessageBus& bus);
  ~DashboardServer() override;

  std::uint16_t port() const { return web_->port(); }
  /// Whether the web page was built; Foxglove can connect without it.
  bool has_page() const { return !files_.empty(); }
  HubCounters counters() const { return hub_.counters(); }

  WebResponse respond(const WebRequest& request) override;
  std::variant<WebUpgrade, WebResponse> upgrade(const WebRequest& request) override;

 private:
  DashboardServer(const DashboardServerConfig& config, MessageBus& bus);
  std::optional<WebResponse> refusal(const WebRequest& request) const;
  WebResponse page(const WebRequest& request) const;
  WebResponse metrics() const;

  DashboardServerConfig config_;
  MessageBus& bus_;
  AccessRules access_;
  StaticFiles files_;
  FoxgloveHub hub_;
  std::unique_ptr<WebServer> web_;
};

}  // namespace sovo::bridge
