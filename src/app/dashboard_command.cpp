#include <sys/resource.h>

#include <charconv>
#include <cstdlib>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "sovo/app/commands.h"
#include "sovo/app/config_options.h"
#include "sovo/app/failure.h"
#include "sovo/app/stop_signal.h"
#include "sovo/bridge/dashboard/dashboard_server.h"
#include "sovo/bridge/dashboard/dds_bus.h"

namespace sovo::app {
namespace {

std::vector<std::string> comma_separated(const std::string& text) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, ',');) {
    if (!part.empty()) parts.push_back(part);
  }
  return parts;
}

template <class Number>
std::optional<Number> parse_number(const std::string& text) {
  Number value{};
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

Result<std::vector<int>> parse_domains(const std::string& text) {
  std::vector<int> domains;
  for (const std::string& part : comma_separated(text)) {
    const auto domain = parse_number<int>(part);
    if (!domain || *domain < 0) return Error{"domain '" + part + "': a number from 0 to 232"};
    domains.push_back(*domain);
  }
  return domains;
}

/// "ADDRESS:PORT", "[ADDRESS]:PORT" or ":PORT" for loopback.
Result<void> parse_listen(const std::string& text, bridge::WebServerConfig* web) {
  const auto colon = text.rfind(':');
  const auto port = colon == std::string::npos
                        ? std::nullopt
                        : parse_number<std::uint16_t>(text.substr(colon + 1));
  if (!port) return Error{"--listen is '" + text + "': give ADDRESS:PORT, as 127.0.0.1:8765"};
  std::string address = text.substr(0, colon);
  if (address.starts_with('[') && address.ends_with(']')) {
    address = address.substr(1, address.size() - 2);
  }
  if (!address.empty()) web->address = address;
  web->port = *port;
  return {};
}

/// Who may look must be said wherever more than this machine's people could.
Result<void> check_safety(const DashboardSection& section, const bridge::WebServerConfig& web) {
  if (section.tls_cert.empty() != section.tls_key.empty()) {
    return Error{"--tls-cert and --tls-key go together"};
  }
  const std::string advice =
      " needs --token-file FILE; make one with: (umask 077; openssl rand -hex 32 > FILE)";
  if (section.token_file.empty() && !bridge::is_loopback_address(web.address)) {
    return Error{"listening on " + web.address + ", outside this machine," + advice};
  }
  if (section.token_file.empty() && section.allow_commands) {
    return Error{"--allow-commands" + advice};
  }
  return {};
}

Result<bridge::DashboardServerConfig> server_config(const DashboardSection& section) {
  bridge::DashboardServerConfig config;
  if (auto done = parse_listen(section.listen, &config.web); !done) return done.failure();
  if (auto done = check_safety(section, config.web); !done) return done.failure();
  config.web.tls_cert = section.tls_cert;
  config.web.tls_key = section.tls_key;
  config.allowed_origins = comma_separated(section.allow_origin);
  config.hub.allow_commands = section.allow_commands;
  if (!section.token_file.empty()) {
    auto token = bridge::read_token_file(section.token_file);
    if (!token) return token.failure();
    config.token = std::move(*token);
  }
  return config;
}

/// The page's address; the token is left out, for logs are read by others.
std::string address_of(const bridge::DashboardServerConfig& config, std::uint16_t port) {
  const bool any = config.web.address == "0.0.0.0" || config.web.address == "::";
  std::string host = any ? "localhost" : config.web.address;
  if (host.find(':') != std::string::npos) host = "[" + host + "]";
  return (config.web.tls_cert.empty() ? "http://" : "https://") + host + ":" +
         std::to_string(port) + "/";
}

void log_start(const bridge::DashboardServerConfig& config, const bridge::DashboardServer& server) {
  if (!server.has_page()) {
    spdlog::warn(
        "the web page was not built with this program: install nodejs and npm, then run "
        "scripts/build; Foxglove can connect all the same");
  }
  if (!bridge::is_loopback_address(config.web.address) && config.web.tls_cert.empty()) {
    spdlog::warn(
        "NOT ENCRYPTED: on {} everybody on the network can read along, the token too; "
        "give --tls-cert and --tls-key",
        config.web.address);
  }
  const std::string address = address_of(config, server.port());
  spdlog::info("dashboard: {}{}", address,
               config.token.empty() ? "" : "?token=... (the token stands in the token file)");
  spdlog::info("Foxglove connects to {}", "ws" + address.substr(4));
}

/// Starts the desktop's browser, which is left alone from then on.
void open_browser(const std::string& address) {
  if (std::getenv("DISPLAY") == nullptr && std::getenv("WAYLAND_DISPLAY") == nullptr) {
    spdlog::info("no display here; open {} yourself", address);
    return;
  }
  const std::string command = "xdg-open '" + address + "' >/dev/null 2>&1 &";
  if (std::system(command.c_str()) != 0) spdlog::warn("no browser could be started");
}

/// Who watches must not hold up who drives: this thread, and all that it starts from now on, a
/// browser too, come after the odometry on the same machine.
void give_way() {
  constexpr int kNiceness = 10;
  (void)setpriority(PRIO_PROCESS, 0, kNiceness);
}

int run_dashboard(const AppConfig& config, bool open) {
  give_way();
  auto settings = server_config(config.dashboard);
  if (!settings) return fail(kUsage, settings.error());
  const auto domains = parse_domains(config.dashboard.domains);
  if (!domains) return fail(kUsage, domains.error());
  StopSignal stop;  // before the threads of bus and server
  auto bus = bridge::DdsBus::open(config.dds, *domains);
  if (!bus) return fail(kFailed, bus.error());
  for (const std::string& note : (*bus)->notes()) spdlog::info("{}", note);
  auto server = bridge::DashboardServer::open(*settings, **bus);
  if (!server) return fail(kFailed, server.error());
  log_start(*settings, **server);
  if (open) open_browser(address_of(*settings, (*server)->port()));
  while (!stop.requested()) std::this_thread::sleep_for(std::chrono::milliseconds(100));
  const bridge::HubCounters counters = (*server)->counters();
  spdlog::info("passed on {} messages; slow clients missed {}", counters.forwarded,
               counters.missed);
  return kOk;
}

}  // namespace

void add_dashboard_command(const Command& program) {
  const Command command =
      program.add_command("dashboard", "A web page to watch, and a port for Foxglove");
  auto open = std::make_shared<bool>(false);
  command.flag("--open", "Open the page in the browser of this desktop", open.get());
  auto options = std::make_shared<ConfigOptions>(command);
  options
      ->value("--listen", "dashboard.listen", "Where to listen (default 127.0.0.1:8765)",
              "ADDRESS:PORT")
      .value("--domain", "dashboard.domains", "DDS domains (else ROS_DOMAIN_ID, else 0)", "N[,N]")
      .value("--network", "dds.network", "Network interface or address of DDS (default lo)", "NAME")
      .value("--token-file", "dashboard.token_file", "Token that clients must know, mode 0600",
             "FILE")
      .value("--tls-cert", "dashboard.tls_cert", "Certificate for TLS (PEM)", "FILE")
      .value("--tls-key", "dashboard.tls_key", "Its key (PEM)", "FILE")
      .value("--allow-origin", "dashboard.allow_origin", "Web sites whose pages may connect",
             "ORIGIN[,ORIGIN]")
      .flag("--allow-commands", "dashboard.allow_commands",
            "Let clients with the token reset, pause and record");
  command.action([options, open] {
    const auto config = options->load();
    return config ? run_dashboard(*config, *open) : fail(kUsage, config.error());
  });
}

}  // namespace sovo::app
