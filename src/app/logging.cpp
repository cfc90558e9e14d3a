#include "sovo/app/logging.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

namespace sovo::app {

std::vector<std::string> log_levels() {
  return {"trace", "debug", "info", "warning", "error", "off"};
}

void set_up_logging(const std::string& level) {
  auto logger = std::make_shared<spdlog::logger>(
      "sovo", std::make_shared<spdlog::sinks::stderr_color_sink_mt>());
  logger->set_pattern("[%H:%M:%S.%e] [%^%l%$] %v");
  logger->set_level(spdlog::level::from_str(level));
  spdlog::set_default_logger(std::move(logger));
}

}  // namespace sovo::app
