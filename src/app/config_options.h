#pragma once

#include <string>
#include <vector>

#include "sovo/app/app_config.h"
#include "sovo/app/command.h"
#include "sovo/io/result.h"

namespace sovo::app {

/// Options of a subcommand that stand for keys of the configuration.
class ConfigOptions {
 public:
  explicit ConfigOptions(const Command& command) : command_(command) {}

  /// `--name VALUE` sets `key`; `type` is what `--help` shows for the value.
  ConfigOptions& value(const std::string& name, const std::string& key, const std::string& help,
                       const std::string& type = "");
  /// `--name VALUE`, which may be repeated, sets the list `key`.
  ConfigOptions& list(const std::string& name, const std::string& key, const std::string& help,
                      const std::string& type);
  /// `--name` sets `key` to true.
  ConfigOptions& flag(const std::string& name, const std::string& key, const std::string& help);

  /// Whether the user named an option. Call after parsing.
  bool is_given(const std::string& name) const;

  /// The configuration: defaults, then the preset, `--config`, `--set`, and these options, each
  /// winning over those before. Call after parsing.
  Result<AppConfig> load() const;

 private:
  struct Binding {
    std::string name;
    CommandOption option;
    std::string key;
    enum Kind { kValue, kList, kFlag } kind;
  };
  static std::string value_of(const Binding& binding);
  std::vector<std::string> assignments() const;

  Command command_;
  std::vector<Binding> bindings_;
};

/// Whether the values make sense; `load` asks already.
Result<void> check_config(const AppConfig& config);

/// Options of every command that talks to the bus.
void add_dds_options(ConfigOptions& options);
/// Options of every command that reads a dataset, but for its path.
void add_dataset_options(ConfigOptions& options);
/// Options of every command that renders a world, beside those of a dataset.
void add_sim_options(ConfigOptions& options);
/// Options of every command that runs the odometry.
void add_odometry_options(ConfigOptions& options);

}  // namespace sovo::app
