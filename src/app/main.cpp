#include <exception>
#include <iostream>

#include "sovo/app/commands.h"
#include "sovo/app/exit_codes.h"
#include "sovo/app/logging.h"

namespace {

using sovo::app::Command;

void add_global_options(const Command& root) {
  root.option("--config", "YAML file with a section for each process; `sovo config` prints one")
      .type("FILE.yaml");
  root.option("--set", "Override one key of the configuration, KEY=VALUE; may be repeated")
      .type("KEY=VALUE")
      .repeatable();
  root.option("--log-level", "How much is logged to stderr", sovo::app::set_up_logging)
      .one_of(sovo::app::log_levels())
      .show_default("info");
}

int run(int argc, char** argv) {
  using namespace sovo::app;
  Program program("sovo", "Scaled visual odometry from a stereo camera, on DDS.", SOVO_VERSION);
  const Command root = program.root();
  root.footer(kExitCodesHelp);
  add_global_options(root);
  set_up_logging("info");
  add_run_command(root);
  add_camera_command(root);
  add_vo_command(root);
  add_status_command(root);
  add_topic_command(root);
  add_command_command(root);
  add_dashboard_command(root);
  add_record_command(root);
  add_replay_command(root);
  add_recover_command(root);
  add_convert_command(root);
  add_replay_test_command(root);
  add_report_command(root);
  add_eval_command(root);
  add_bench_command(root);
  add_calib_command(root);
  add_config_command(root);
  add_doctor_command(root);
  return program.run(argc, argv);
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
