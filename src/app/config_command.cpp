#include <iostream>
#include <memory>

#include "sovo/app/commands.h"
#include "sovo/app/config_options.h"
#include "sovo/app/failure.h"
#include "sovo/io/yaml_config.h"

namespace sovo::app {

void add_config_command(CLI::App& app, int* exit_code) {
  CLI::App* command = app.add_subcommand(
      "config",
      "Print the configuration as YAML with comments: the defaults, or what --config, "
      "--set and the options make of them");
  auto options = std::make_shared<ConfigOptions>(command);
  options->value("--preset", "preset", "Values to begin with", "embedded|default|quality");
  command->callback([options, exit_code] {
    const auto config = options->load();
    if (!config) {
      *exit_code = fail(kUsage, config.error());
      return;
    }
    std::cout << dump_config(*config);
  });
}

}  // namespace sovo::app
