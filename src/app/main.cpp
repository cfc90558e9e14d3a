#include <exception>
#include <iostream>

#include "sovo/app/commands.h"
#include "sovo/app/exit_codes.h"
#include "sovo/app/logging.h"

namespace {

void add_global_options(CLI::App& app) {
  app.set_version_flag("--version", "sovo " SOVO_VERSION);
  app.add_option("--config", "YAML file with a section for each process; `sovo config` prints one")
      ->type_name("FILE.yaml");
  app.add_option("--set", "Override one key of the configuration, KEY=VALUE; may be repeated")
      ->type_name("KEY=VALUE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->take_all();
  app.add_option_function<std::string>("--log-level", sovo::app::set_up_logging,
                                       "How much is logged to stderr")
      ->check(CLI::IsMember(sovo::app::log_levels()))
      ->default_str("info");
}

int run(int argc, char** argv) {
  using namespace sovo::app;
  CLI::App app("Scaled visual odometry from a stereo camera, on DDS.");
  app.name("sovo");
  app.footer(kExitCodesHelp);
  app.require_subcommand(1);
  app.fallthrough();
  add_global_options(app);
  set_up_logging("info");

  int exit_code = kOk;
  add_run_command(app, &exit_code);
  add_camera_command(app, &exit_code);
  add_vo_command(app, &exit_code);
  add_status_command(app, &exit_code);
  add_command_command(app, &exit_code);
  add_eval_command(app, &exit_code);
  add_calib_command(app, &exit_code);
  add_config_command(app, &exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kOk : kUsage;
  }
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "sovo: " << error.what() << "\n";
    return sovo::app::kFailed;
  }
}
