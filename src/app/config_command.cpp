#include <iostream>
#include <memory>

#include "sovo/app/commands.h"
#include "sovo/app/config_options.h"
#include "sovo/app/failure.h"
#include "sovo/io/yaml_config.h"

namespace sovo::app {

void add_config_command(const Command& program) {
  const Command command = program.add_command(
      "config",
      "Print the configuration as YAML with comments: the defaults, or what --config, "
      "--set and the options make of them");
  auto options = std::make_shared<ConfigOptions>(command);
  options->value("--preset", "preset", "Values to begin with", "embedded|default|quality");
  command.action([options]() -> int {
    const auto config = options->load();
    if (!config) return fail(kUsage, config.error());
    std::cout << dump_config(*config);
    return kOk;
  });
}

}  // namespace sovo::app
